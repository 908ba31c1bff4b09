//! Picture files: textures in, EXR and PNG out (always to memory first: `batch` puts bytes on disk), EXR in.

pub mod decode;
pub mod exr;
mod exr_header;
pub mod exr_read;
pub mod header;
pub mod old;
pub mod png;
pub mod radiance_map;
