//! A material's table in a settings file: keys that are left out keep the named material's defaults.

use fingerpad_formats::units::{finite, poisson, positive};
use serde::{Deserialize, Deserializer};

use super::{Ogden, SaintVenantKirchhoff};

/// The keys of [`Ogden`] that a file gives.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct OgdenKeys {
    #[serde(default, deserialize_with = "some_positive")]
    mu_mpa: Option<f64>,
    #[serde(default, deserialize_with = "some_finite")]
    alpha: Option<f64>,
    #[serde(default, deserialize_with = "some_positive")]
    d_per_mpa: Option<f64>,
}

/// The keys of [`SaintVenantKirchhoff`] that a file gives.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SaintVenantKirchhoffKeys {
    #[serde(default, deserialize_with = "some_positive")]
    young_mpa: Option<f64>,
    #[serde(default, deserialize_with = "some_poisson")]
    poisson: Option<f64>,
}

fn some_positive<'de, D: Deserializer<'de>>(from: D) -> Result<Option<f64>, D::Error> {
    positive(from).map(Some)
}

fn some_finite<'de, D: Deserializer<'de>>(from: D) -> Result<Option<f64>, D::Error> {
    finite(from).map(Some)
}

fn some_poisson<'de, D: Deserializer<'de>>(from: D) -> Result<Option<f64>, D::Error> {
    poisson(from).map(Some)
}

/// An Ogden material; what the file leaves out is that of `default`.
pub fn ogden<'de, D: Deserializer<'de>>(from: D, default: Ogden) -> Result<Ogden, D::Error> {
    let keys = OgdenKeys::deserialize(from)?;
    Ok(Ogden {
        mu_mpa: keys.mu_mpa.unwrap_or(default.mu_mpa),
        alpha: keys.alpha.unwrap_or(default.alpha),
        d_per_mpa: keys.d_per_mpa.unwrap_or(default.d_per_mpa),
    })
}

/// A Saint Venant-Kirchhoff material; what the file leaves out is that of `default`.
pub fn saint_venant_kirchhoff<'de, D: Deserializer<'de>>(
    from: D,
    default: SaintVenantKirchhoff,
) -> Result<SaintVenantKirchhoff, D::Error> {
    let keys = SaintVenantKirchhoffKeys::deserialize(from)?;
    Ok(SaintVenantKirchhoff {
        young_mpa: keys.young_mpa.unwrap_or(default.young_mpa),
        poisson: keys.poisson.unwrap_or(default.poisson),
    })
}
