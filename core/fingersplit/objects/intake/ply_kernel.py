"""Kernel of `ply`: where the values of binary rows with lists stand."""

from fingersplit.compilation import kernel

__all__ = ["find_values"]


@kernel
def find_values(octets, at, widths, length_widths, signed, big_endian, places, sizes):
    """Walk through rows whose lists say their own lengths.

    Args:
        octets: The file's body, uint8.
        at: Where the first row begins.
        widths: Bytes of a value of each property.
        length_widths: Bytes of the length of each list, 0 for a property that is no list.
        signed: Whether that length is signed.
        big_endian: Whether the most significant byte comes first.
        places: Gets where the first value of each property stands, (rows, properties).
        sizes: Gets how many values it has, (rows, properties).

    Returns:
        The byte behind the last row, or -1 where a length is negative, and the number of whole rows.
    """
    for row in range(len(places)):
        for k in range(widths.size):
            size = 1
            if length_widths[k] > 0:
                if at + length_widths[k] > octets.size:
                    return at, row
                size = 0
                for m in range(length_widths[k]):
                    place = at + (m if big_endian else length_widths[k] - 1 - m)
                    size = size * 256 + octets[place]
                if signed[k] and size >= 1 << (8 * length_widths[k] - 1):
                    return -1, row
                at += length_widths[k]
            places[row, k], sizes[row, k] = at, size
            at += size * widths[k]
            if at > octets.size:
                return octets.size, row
    return at, len(places)
