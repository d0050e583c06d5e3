//! Numerical methods that fits and diagnoses share.
//!
//! | module | method |
//! | --- | --- |
//! | [`student`] | quantiles of Student's t |
//! | [`symmetric`] | dense symmetric matrices, Cholesky factorisation with dropped pivots, the scalar product |
//! | [`least_squares`] | small least-squares problems by QR and SVD, and normal equations by blocks with jackknife deviations |
//! | [`jackknife`] | variances from estimates with one block left out in turn |
//! | [`covariance_root`] | a covariance as the product of a matrix with its transpose |
//! | [`spline_basis`] | natural cubic splines that are 1 at one node and 0 at the others |
//! | [`bspline`] | cubic B-splines on even knots |
//!
//! Medians, quantiles and the normal distribution's constants are in [`pam_data::statistics`]. statrs provides the distributions, nalgebra QR, SVD, eigenvectors and the Cholesky factorisation of small full-rank systems. [`symmetric`] is a
//! factorisation of its own because a fit has unknowns that the data do not determine: nalgebra's fails at such a pivot, this one
//! leaves the unknown at zero and counts it.
//!
//! ```
//! use pam_fit::numerics::symmetric::Symmetric;
//!
//! // Least squares of y = a + b x through (0, 1), (1, 3), (2, 5).
//! let mut normal = Symmetric::zeros(2);
//! let mut right = [0.0; 2];
//! for (x, y) in [(0.0, 1.0), (1.0, 3.0), (2.0, 5.0)] {
//!     normal.add_row(&[(0, 1.0), (1, x)], 1.0);
//!     right[0] += y;
//!     right[1] += x * y;
//! }
//! let found = normal.factor().solve(&right);
//! assert!((found[0] - 1.0).abs() < 1e-12 && (found[1] - 2.0).abs() < 1e-12);
//! ```

pub mod bspline;
pub mod covariance_root;
pub mod jackknife;
pub mod least_squares;
pub mod spline_basis;
pub mod student;
pub mod symmetric;
