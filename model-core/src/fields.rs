//! Values as bytes, field by field: postcard's encoding in a tenth of the code that a small flash has room for.
//!
//! A host reads and writes messages with `serde` and `postcard`. Code made from those for each message fills a quarter of a
//! controller's flash, so a controller walks the fields of a value that is there already: the same function reads them from bytes
//! or writes them. The bytes are postcard's, which tests compare for every message:
//!
//! | value | bytes |
//! | --- | --- |
//! | `f32` | four, little-endian |
//! | `u8`, `i8`, `bool` | one |
//! | `u16`, `u32`, `u64`, lengths | seven bits a byte, the lowest first, the eighth bit set where more follow |
//! | variant of an enum, `Option` | its number in one byte, then its fields |
//! | list | its length, then its elements; an array has no length |
//!
//! A read that fails leaves the rest of the value as it was, and [`Walk::is_whole`] says so at the end.

use heapless::{Vec, VecView};

/// Where bytes come from or go to.
pub trait Way {
    /// Whether values are filled from the bytes; otherwise the bytes are written from the values.
    fn reads(&self) -> bool;
    /// Fills `bytes` with the next ones, or writes them. Says whether they were there, or had room.
    fn pass(&mut self, bytes: &mut [u8]) -> bool;
}

/// Bytes to read.
impl Way for &[u8] {
    fn reads(&self) -> bool {
        true
    }
    fn pass(&mut self, bytes: &mut [u8]) -> bool {
        let Some((next, rest)) = self.split_at_checked(bytes.len()) else { return false };
        bytes.copy_from_slice(next);
        *self = rest;
        true
    }
}

/// Placed to write.
impl Way for &mut [u8] {
    fn reads(&self) -> bool {
        false
    }
    fn pass(&mut self, bytes: &mut [u8]) -> bool {
        let Some((next, rest)) = core::mem::take(self).split_at_mut_checked(bytes.len()) else {
            return false;
        };
        next.copy_from_slice(bytes);
        *self = rest;
        true
    }
}

/// One pass over a value's fields.
pub struct Walk<'a> {
    way: &'a mut dyn Way,
    whole: bool,
}

impl<'a> Walk<'a> {
    /// A walk that reads or writes.
    pub fn new(way: &'a mut dyn Way) -> Self {
        Self { way, whole: true }
    }

    /// Whether all fields so far were read or written.
    pub fn is_whole(&self) -> bool {
        self.whole
    }

    fn reads(&self) -> bool {
        self.way.reads()
    }

    // None of these is grown into the code of each message.

    #[inline(never)]
    fn bytes(&mut self, bytes: &mut [u8]) {
        self.whole = self.whole && self.way.pass(bytes);
    }

    #[inline(never)]
    fn byte(&mut self, byte: u8) -> u8 {
        let mut one = [byte];
        self.bytes(&mut one);
        one[0]
    }

    /// A number in at most n bytes, of which the last may have n bits.
    #[inline(never)]
    fn number(&mut self, number: u64, most: usize, bits: u32) -> u64 {
        let mut bytes = [0_u8; 10];
        let mut length = 0;
        if !self.reads() {
            let mut rest = number;
            while rest > 0x7F {
                self.byte(rest as u8 | 0x80);
                rest >>= 7;
            }
            self.byte(rest as u8);
            return number;
        }
        for place in &mut bytes[..most] {
            *place = self.byte(0);
            length += 1;
            if *place & 0x80 == 0 {
                break;
            }
        }
        let mut found = 0;
        for byte in bytes[..length].iter().rev() {
            found = found << 7 | u64::from(byte & 0x7F);
        }
        // What is behind the last bit, the sign that more follow with it.
        self.whole &= bytes[most - 1] >> bits == 0;
        found
    }

    /// The number of a variant, below `count`.
    #[inline(never)]
    pub fn variant(&mut self, number: u8, count: u8) -> u8 {
        let found = self.byte(number);
        if found >= count {
            self.whole = false;
            return number;
        }
        found
    }

    /// Writes the number of a variant of what is only written.
    #[inline(never)]
    pub fn tell(&mut self, number: u8) {
        self.whole &= !self.reads();
        self.byte(number);
    }
}

/// A value whose fields can be walked.
pub trait Fields {
    /// Reads or writes the fields in their order.
    fn walk(&mut self, walk: &mut Walk<'_>);
}

/// Reads a value into its place; bytes behind it are left. Says whether it was there.
#[inline(never)]
pub fn read(mut bytes: &[u8], value: &mut dyn Fields) -> bool {
    let mut walk = Walk::new(&mut bytes);
    value.walk(&mut walk);
    walk.is_whole()
}

/// Writes a value; gives its length, if it had room.
#[inline(never)]
pub fn write(value: &mut dyn Fields, room: &mut [u8]) -> Option<usize> {
    let length = room.len();
    let mut rest = room;
    let mut walk = Walk::new(&mut rest);
    value.walk(&mut walk);
    walk.is_whole().then(|| length - rest.len())
}

/// Fields of a structure, in the order in which it declares them.
#[macro_export]
macro_rules! fields {
    ($name:ty { $($field:ident),* $(,)? }) => {
        impl $crate::fields::Fields for $name {
            fn walk(&mut self, walk: &mut $crate::fields::Walk<'_>) {
                let Self { $($field),* } = self;
                $($crate::fields::Fields::walk($field, walk);)*
            }
        }
    };
}

/// Declares an enum without fields; its variants are numbered in their order.
macro_rules! codes {
    ($(#[$outer:meta])* pub enum $name:ident { $($(#[$inner:meta])* $variant:ident),* $(,)? }) => {
        $(#[$outer])*
        pub enum $name {
            $($(#[$inner])* $variant,)*
        }

        impl $name {
            /// All of them, in the order of their codes.
            pub const ALL: [Self; [$(stringify!($variant)),*].len()] = [$(Self::$variant),*];
        }

        impl $crate::fields::Fields for $name {
            #[inline(never)]
            fn walk(&mut self, walk: &mut $crate::fields::Walk<'_>) {
                const ALL: &[$name] = &<$name>::ALL;
                if let Some(found) = ALL.get(usize::from(walk.variant(*self as u8, ALL.len() as u8))) {
                    *self = *found;
                }
            }
        }
    };
}

/// An enum with fields, as `NUMBER VARIANT { FIELD: NAME }`; the field of a tuple is its place.
macro_rules! choices {
    ($name:ty { $($number:literal $variant:ident { $($field:tt: $binding:ident),* }),* $(,)? }) => {
        impl $crate::fields::Fields for $name {
            fn walk(&mut self, walk: &mut $crate::fields::Walk<'_>) {
                const COUNT: u8 = [$($number),*].len() as u8;
                let before = match self { $(Self::$variant { .. } => $number,)* };
                let number = walk.variant(before, COUNT);
                if number != before {
                    *self = match number {
                        $($number => Self::$variant { $($field: Default::default()),* },)*
                        _ => return,
                    };
                }
                match self {
                    $(Self::$variant { $($field: $binding),* } => {
                        $($crate::fields::Fields::walk($binding, walk);)*
                    })*
                }
            }
        }
    };
}

/// As [`choices`], for what a controller says and never reads.
macro_rules! one_of {
    ($name:ty { $($number:literal $variant:ident { $($field:tt: $binding:ident),* }),* $(,)? }) => {
        impl $crate::fields::Fields for $name {
            fn walk(&mut self, walk: &mut $crate::fields::Walk<'_>) {
                walk.tell(match self { $(Self::$variant { .. } => $number,)* });
                match self {
                    $(Self::$variant { $($field: $binding),* } => {
                        $($crate::fields::Fields::walk($binding, walk);)*
                    })*
                }
            }
        }
    };
}

pub(crate) use {choices, codes, fields, one_of};

impl Fields for () {
    fn walk(&mut self, _: &mut Walk<'_>) {}
}

impl Fields for u8 {
    fn walk(&mut self, walk: &mut Walk<'_>) {
        *self = walk.byte(*self);
    }
}

impl Fields for i8 {
    fn walk(&mut self, walk: &mut Walk<'_>) {
        *self = walk.byte(*self as u8) as i8;
    }
}

impl Fields for bool {
    #[inline(never)]
    fn walk(&mut self, walk: &mut Walk<'_>) {
        *self = walk.variant(u8::from(*self), 2) == 1;
    }
}

impl Fields for u16 {
    #[inline(never)]
    fn walk(&mut self, walk: &mut Walk<'_>) {
        *self = walk.number(u64::from(*self), 3, 2) as u16;
    }
}

impl Fields for u32 {
    #[inline(never)]
    fn walk(&mut self, walk: &mut Walk<'_>) {
        *self = walk.number(u64::from(*self), 5, 4) as u32;
    }
}

impl Fields for u64 {
    #[inline(never)]
    fn walk(&mut self, walk: &mut Walk<'_>) {
        *self = walk.number(*self, 10, 1);
    }
}

impl Fields for f32 {
    #[inline(never)]
    fn walk(&mut self, walk: &mut Walk<'_>) {
        let mut bytes = self.to_le_bytes();
        walk.bytes(&mut bytes);
        *self = Self::from_le_bytes(bytes);
    }
}

impl<V: Fields + Default> Fields for Option<V> {
    fn walk(&mut self, walk: &mut Walk<'_>) {
        if walk.variant(u8::from(self.is_some()), 2) == 1 {
            self.get_or_insert_with(V::default).walk(walk);
        } else {
            *self = None;
        }
    }
}

impl<V: Fields, const N: usize> Fields for [V; N] {
    fn walk(&mut self, walk: &mut Walk<'_>) {
        each(self, walk);
    }
}

#[inline(never)]
fn each<V: Fields>(values: &mut [V], walk: &mut Walk<'_>) {
    for value in values {
        value.walk(walk);
    }
}

impl<V: Fields + Default + Clone, const N: usize> Fields for Vec<V, N> {
    fn walk(&mut self, walk: &mut Walk<'_>) {
        list(self.as_mut_view(), walk);
    }
}

#[inline(never)]
fn list<V: Fields + Default + Clone>(values: &mut VecView<V>, walk: &mut Walk<'_>) {
    let mut length = values.len() as u32;
    length.walk(walk);
    if walk.reads() && values.resize_default(length as usize).is_err() {
        walk.whole = false;
        return;
    }
    each(values, walk);
}
