//! Lane types.
