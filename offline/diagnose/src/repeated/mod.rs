//! Questions that take more than one decision: several fingers, thinned runs, simulated runs; and a look before the first one.
//!
//! Main functions: [`diagnose_group`](group::diagnose_group), [`stability`](stability::stability), [`power`](power::power),
//! [`survey`](survey::survey). May use: report, verdict and all below.

pub mod dry_run;
pub mod group;
pub mod power;
pub mod redecision;
pub mod stability;
pub mod survey;
