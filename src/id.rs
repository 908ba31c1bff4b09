//! Typed indices into a scene's lists, known to everything that refers to one of its parts.

macro_rules! id {
    ($name:ident, $of:literal) => {
        #[doc = concat!("Index of ", $of, " in its scene.")]
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $name(pub u32);

        impl $name {
            /// As an index into the scene's list.
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }
    };
}
id!(MeshId, "a mesh");
id!(MaterialId, "a material");
id!(TextureId, "a texture");
id!(ImageId, "an image");
