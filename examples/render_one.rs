//! throwaway
use prt::render::*;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let (scene, times) = prt::load::load(a[1].as_ref(), &Default::default()).unwrap_or_else(|e| panic!("{e}"));
    let accel = match a[2].as_str() {
        "embree" => AccelChoice::Embree,
        "bvh" => AccelChoice::Bvh,
        _ => AccelChoice::Linear,
    };
    let spp: u32 = a[3].parse().unwrap();
    let (w, h): (u32, u32) = (a[4].parse().unwrap(), a[5].parse().unwrap());
    let s = RenderSettings {
        width: w,
        height: h,
        spp,
        accel,
        embree_dirs: vec![".embree".into()],
        filter: Filter::Box { width: 1.0 },
        max_bounces: Some(32),
        threads: a.get(7).map(|t| t.parse().unwrap()),
        ..Default::default()
    };
    let f = render(&scene, 0, &s, &Progress::default()).unwrap_or_else(|e| panic!("{e}"));
    let n = f.pixels.len() as f64;
    let mean = f.pixels.iter().fold([0.0; 3], |m, p| [0, 1, 2].map(|c| m[c] + p[c] as f64 / n));
    let st = &f.stats;
    let rays = st.camera_rays + st.bounce_rays + st.shadow_rays;
    println!(
        "{} mean {mean:?} load {:?} build {:.3} render {:.3} s, {:.2} Mpaths/s {:.2} Mray/s lanes {} {:?} nonfinite {}",
        a[1],
        times,
        st.build_seconds,
        st.render_seconds,
        st.camera_rays as f64 / st.render_seconds / 1e6,
        rays as f64 / st.render_seconds / 1e6,
        st.lanes,
        st.accel.used,
        st.non_finite_samples
    );
    let mut out = vec![];
    for p in &f.pixels {
        for c in p {
            let v = (c / (1.0 + 0.3 * c)).clamp(0.0, 1.0);
            let v = if v < 0.0031308 { v * 12.92 } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
            out.push((v * 255.0) as u8);
        }
    }
    if a.len() > 6 {
        ::image::save_buffer(&a[6], &out, w, h, ::image::ExtendedColorType::Rgb8).unwrap();
    }
}
