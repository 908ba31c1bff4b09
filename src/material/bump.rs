//! Height maps (`bump`, `map_Bump` of MTL): how the height changes along a triangle's edges.

use super::table::MaterialTable;
use crate::math::UvSets;
use crate::texture::lookup::{Encoding, NO_TEXTURE, TextureTable};
use simd::{Float, Lanes, Mask, Uint};

impl MaterialTable {
    /// Change of height along the two edges that leave corner 0, metres per edge, by the slope at `uvs`; 0 where there
    /// is no height map. `corners`: the corners' texture coordinates.
    ///
    /// The slope is the difference over one texel, half of it to either side: between texel centres that of the
    /// bilinear interpolant averaged over a texel, so it has no steps.
    #[inline(always)]
    pub fn bump_along_edges<L: Lanes>(
        &self,
        textures: &TextureTable,
        material: L::U,
        uvs: &UvSets<L>,
        corners: &[UvSets<L>; 3],
        active: L::M,
    ) -> [L::F; 2] {
        let zero = L::F::zero();
        let texture = self.record::<L>(material, 5)[3].to_bits();
        let has = active & !texture.eq(L::U::splat(NO_TEXTURE));
        if !has.any() {
            return [zero, zero];
        }
        let [_, height, plain, _] = self.record::<L>(material, 6);
        let plain = plain.to_bits();
        let [u, v] = textures.coordinates::<L>(texture, uvs);
        let [width, rows] = textures.size::<L>(texture);
        let half = L::F::splat(0.5);
        let (du, dv) = (half / width, half / rows);
        let across = sample::<L>(textures, plain, u + du, v) - sample::<L>(textures, plain, u - du, v);
        let down = sample::<L>(textures, plain, u, v + dv) - sample::<L>(textures, plain, u, v - dv);
        let (h_u, h_v) = (across * width * height, down * rows * height);
        let [u0, v0] = textures.coordinates::<L>(texture, &corners[0]);
        let [u1, v1] = textures.coordinates::<L>(texture, &corners[1]);
        let [u2, v2] = textures.coordinates::<L>(texture, &corners[2]);
        let along1: L::F = h_u * (u1 - u0) + h_v * (v1 - v0);
        let along2: L::F = h_u * (u2 - u0) + h_v * (v2 - v0);
        [along1.masked(has & along1.is_finite()), along2.masked(has & along2.is_finite())]
    }
}

/// The height texel at (`u`, `v`), in [0, 1].
#[inline(always)]
fn sample<L: Lanes>(textures: &TextureTable, binding: L::U, u: L::F, v: L::F) -> L::F {
    textures.lookup::<L>(binding, &UvSets::single(u, v), Encoding::Linear).rgb.x
}
