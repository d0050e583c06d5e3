//! Controller firmware: board-independent library.
#![no_std]
