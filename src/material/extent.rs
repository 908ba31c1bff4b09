//! What a closure has room for: sixteen lanes of what few materials have are kilobytes, which all others would carry along.

/// Which parts a closure may have.
pub trait Extent {
    /// It may have those of `KHR_materials_transmission`, `_iridescence`, `_anisotropy` and their like.
    const IS_RICH: bool;
    /// Room for such a part.
    type Room<T>: Room<T>;
}

/// Room for at most one `T`, or for none.
pub trait Room<T> {
    /// Holds `part`, if there is room for it.
    fn hold(part: Option<T>) -> Self;
    /// What is there.
    fn get(&self) -> Option<&T>;
    /// What is there.
    fn get_mut(&mut self) -> Option<&mut T>;
}

/// Metal and roughness, no room for more: nor is there any code for more.
pub struct Plain;

/// Everything.
pub struct Rich;

impl Extent for Plain {
    const IS_RICH: bool = false;
    type Room<T> = Nowhere;
}

impl Extent for Rich {
    const IS_RICH: bool = true;
    type Room<T> = Option<T>;
}

/// No room.
pub struct Nowhere;

impl<T> Room<T> for Nowhere {
    #[inline(always)]
    fn hold(_: Option<T>) -> Self {
        Self
    }

    #[inline(always)]
    fn get(&self) -> Option<&T> {
        None
    }

    #[inline(always)]
    fn get_mut(&mut self) -> Option<&mut T> {
        None
    }
}

impl<T> Room<T> for Option<T> {
    #[inline(always)]
    fn hold(part: Option<T>) -> Self {
        part
    }

    #[inline(always)]
    fn get(&self) -> Option<&T> {
        self.as_ref()
    }

    #[inline(always)]
    fn get_mut(&mut self) -> Option<&mut T> {
        self.as_mut()
    }
}
