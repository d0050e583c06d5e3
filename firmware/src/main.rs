//! The image of one board.

#![no_std]
#![no_main]

#[cfg(not(any(feature = "mps2-an386", feature = "nucleo-f446re")))]
compile_error!(
    "no board is chosen: enable one of the features mps2-an386, nucleo-f446re (firmware/build does)"
);
#[cfg(all(feature = "mps2-an386", feature = "nucleo-f446re"))]
compile_error!("two boards are chosen: enable only one of the features mps2-an386, nucleo-f446re");

mod boards;
