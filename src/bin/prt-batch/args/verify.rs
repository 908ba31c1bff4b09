//! Options of `prt-batch verify`.

use crate::parse;
use clap::{Args, ValueHint};
use prt::verify::contenders::Backend;
use std::path::PathBuf;

/// What is verified.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum What {
    /// What rays hit.
    Hits,
    /// What materials reflect.
    Materials,
    /// What pixels show.
    Light,
    /// Where rays meet exact shapes.
    Shapes,
}

impl What {
    /// As users call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hits => "hits",
            Self::Materials => "materials",
            Self::Light => "light",
            Self::Shapes => "shapes",
        }
    }
}

#[derive(Args, Debug)]
pub struct VerifyArgs {
    /// What is verified
    ///
    /// hits: what rays hit, by every backend against f64. materials: energy, sampling and reciprocity of what they reflect. light: built-in scenes whose pixels can be written down. shapes: whether rays find every crossing with surfaces of revolution.
    #[arg(value_name = "WHAT", default_value = "hits", value_parser = parse::verify())]
    pub what: What,
    /// .gltf, .glb and .obj files, or folders of them [default: the built-in meshes or materials]
    ///
    /// Of each its default scene; of that all materials.
    #[arg(value_name = "INPUT", value_hint = ValueHint::AnyPath)]
    pub inputs: Vec<PathBuf>,
    /// hits: rays of each kind at each mesh or scene; shapes: rays at each profile [default: 5000]
    #[arg(long, value_name = "N", value_parser = parse::rays)]
    pub rays: Option<usize>,
    /// materials: samples of each chi-square test; light: samples of a pixel [default: 100000 and 1024]
    #[arg(long, value_name = "N", value_parser = parse::samples)]
    pub samples: Option<usize>,
    /// materials, shapes: random ones besides the built-in ones [default: 0 materials, 100 shapes]
    #[arg(long, value_name = "N", value_parser = parse::rays)]
    pub random: Option<usize>,
    /// Other seeds, other rays and samples
    #[arg(long, value_name = "N", default_value = "0", value_parser = parse::seed)]
    pub seed: u64,
    /// hits: ray backends, separated by commas; light: one [default: all that are to be had; auto for light]
    ///
    /// linear, brute force, takes part in hits where there are at most 1000 triangles.
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = parse::backend())]
    pub accel: Vec<Backend>,
    /// Worker threads; they do not change what is found [default: the cores this process may use]
    #[arg(short, long, value_name = "N", value_parser = parse::threads)]
    pub threads: Option<usize>,
    /// Print the result as JSON on stdout
    ///
    /// Its fields are below.
    #[arg(long)]
    pub json: bool,
    /// A row for every kind of rays, every material or every scene, and more rays to repeat faults with
    #[arg(short, long)]
    pub verbose: bool,
}
