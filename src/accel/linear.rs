//! Brute force as an [`super::Accel`]: the oracle.
