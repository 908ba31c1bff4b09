//! Pictures against a reference: error metrics ([`mod@metrics`]), a test of equality that knows about noise ([`blocks`])
//! and the distributions it needs ([`stats`]).

pub mod blocks;
pub mod metrics;
pub mod stats;

pub use blocks::{BlockTest, block_test};
pub use metrics::{Metrics, metrics};
