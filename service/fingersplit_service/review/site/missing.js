// The page of an address that is none: nothing on it changes.
