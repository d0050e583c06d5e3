//! The store on a flash whose power is cut.
