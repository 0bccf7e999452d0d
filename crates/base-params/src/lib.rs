//! Which columns of a regressor can be told apart: rank, base columns, regrouping.
//!
//! The rows of a regressor `W` reveal the parameters `x` only through `y = W x`. Where columns of `W` vanish or depend on
//! each other, this crate finds the base columns `W_b` and the regrouping matrix `K` of
//!
//! `W x = W_b (K x)` for every `x`
//!
//! (Gautier 1991; the categories are those of Radkhah, Kulić and Croft, section II.B).
//!
//! [`TriangularFactor`] condenses any number of rows into one triangle; [`reduce`] decides the rank and answers with a
//! [`Reduction`], whose [`relation`](Reduction::relation) prints a base parameter as people write it.
//!
//! ```
//! use idim_base_params::{ReductionOptions, TriangularFactor, reduce};
//!
//! // The second column is half of the first and the third vanishes.
//! let mut factor = TriangularFactor::new(4);
//! factor.push_rows(&[2.0, 1.0, 0.0, 1.0]);
//! factor.push_rows(&[4.0, 2.0, 0.0, -1.0, 6.0, 3.0, 0.0, 5.0, -2.0, -1.0, 0.0, 3.0]);
//!
//! let reduction = reduce(&factor, &[0, 1, 2, 3], &ReductionOptions::default());
//! assert_eq!(reduction.base, [0, 3]);
//! assert_eq!(reduction.unidentifiable, [2]);
//! assert!(reduction.ambiguity.is_none());
//!
//! let names = ["ZZ1", "M2", "XX1", "MX2"].map(String::from);
//! assert_eq!(reduction.relation(0, &names), "ZZR1 = ZZ1 + 0.5 M2");
//! assert_eq!(reduction.column_relation(1, &names), "M2 = 0.5 ZZ1");
//! ```
//!
//! What it does not do: it knows nothing of robots, draws no random states and estimates no values. The rank it finds is that
//! of the rows it was given: for the structure of a robot give it random states over the full ranges, at least five rows a
//! column.

mod independent;
mod print;
mod rank;
mod reduce;
mod reduction;
mod triangular;

pub use reduce::{ReductionOptions, reduce};
pub use reduction::{Ambiguity, Ghost, Reduction};
pub use triangular::TriangularFactor;
