"""What `forked` loads for programs that compile: numba, and what it sets up once."""

import numba

numba.njit(lambda x: 3.0 * x)(2.0)
