"""SIMD types for the compiler: vectors and masks of eight numbers, and records of eight worlds."""
