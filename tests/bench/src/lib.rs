//! The virtual test bench: a pneumatic artificial muscle, its pneumatics, its load and its instruments, from other physics
//! than the model that is proved against it. It imports nothing of `model-core`.

pub mod lockstep;
