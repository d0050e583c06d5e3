//! The virtual test bench: a pneumatic artificial muscle, its pneumatics, its load and its instruments, from other physics
//! than the model that is proved against it. It imports nothing of `model-core`.

pub mod bench;
pub mod campaigns;
pub mod checks;
pub mod friction;
pub mod lockstep;
pub mod material;
pub mod muscle;
pub mod physics;
pub mod plant;
pub mod pneumatics;
pub mod presets;
pub use pam_protocol as protocol;
pub mod recording;
pub mod rig;
pub mod rng;
pub mod rubber;
mod rubbing;
pub mod sensors;
pub mod surface;
pub mod tube;
pub mod valves;
mod wall_creep;
