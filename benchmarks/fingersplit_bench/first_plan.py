"""Time from the first import to the first plan of a new process; prints it [s]. Run with ``python -m``."""

from time import perf_counter

__all__ = ["main"]

STARTS = 64


def main() -> None:
    """Import the planner, prepare the parametric mug, plan, and print how long that took [s]."""
    began = perf_counter()
    # Imported here, because the imports are part of what is measured.
    from fingersplit.hands.hand import load_hand
    from fingersplit.objects.parametric import mug
    from fingersplit.objects.preparing import prepare_object
    from fingersplit.planning.planning import plan

    plan(prepare_object(mug(), "mug"), load_hand("barrett"), starts=STARTS)
    print(perf_counter() - began)


if __name__ == "__main__":
    main()
