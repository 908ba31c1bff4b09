//! Lane types.

mod buffer;
pub use buffer::Buffer;
