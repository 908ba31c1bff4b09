//! prt.
