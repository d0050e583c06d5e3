//! Places for what is large: tables, a trace, buffers.
//!
//! On a board each is a static of its own, there from the first instruction on, and what uses it holds a reference. So nothing
//! large is ever built on a stack or moved, and the stack stays small. In a process of a host each lies on the heap.

/// A place of one's own.
#[cfg(any(test, feature = "std"))]
pub type Placed<T> = std::boxed::Box<T>;
/// A place of one's own.
#[cfg(not(any(test, feature = "std")))]
pub type Placed<T> = &'static mut T;

/// The room for a value. On a board each use of this macro is one static, which is taken once: there is one controller, one
/// server.
#[cfg(any(test, feature = "std"))]
macro_rules! placed {
    ($type:ty, $empty:expr) => {
        std::boxed::Box::<$type>::new($empty)
    };
}
#[cfg(not(any(test, feature = "std")))]
macro_rules! placed {
    ($type:ty, $empty:expr) => {{
        static PLACE: static_cell::ConstStaticCell<$type> = static_cell::ConstStaticCell::new($empty);
        PLACE.take()
    }};
}
pub(crate) use placed;
