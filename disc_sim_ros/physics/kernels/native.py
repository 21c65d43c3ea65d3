"""C functions and memory by address, for compiled functions.

Addresses are integers, arguments of the compiled function, so that its machine code can be kept
on disk. They must be right: nothing checks them. `native_numba` tells numba how to compile these
functions; plain Python has none of them.
"""


def call(address: int, a: int, b: int, c: int, d: int) -> int:
    """Call a C function of at most four integers or pointers that returns an int.

    Where all arguments are passed in registers, as on x86-64 and 64-bit ARM, a function that takes
    fewer does not notice the rest.
    """
    raise NotImplementedError


def load_byte(address: int) -> int:
    """Return the byte at an address."""
    raise NotImplementedError


def load_int32(address: int) -> int:
    """Return the 32-bit integer at any address, aligned or not."""
    raise NotImplementedError


def load_float(address: int) -> float:
    """Return the double at any address, aligned or not."""
    raise NotImplementedError
