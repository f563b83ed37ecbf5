//! The peers. Each follows its library's documentation, with the Jacobian of [`model`](crate::model) and constants that are set up
//! once.

#[cfg(feature = "adskalman")]
pub mod adskalman;
#[cfg(feature = "crazyflie")]
pub mod crazyflie;
pub mod derived;
#[cfg(feature = "kfilter")]
pub mod kfilter;
#[cfg(feature = "minikalman")]
pub mod minikalman;
#[cfg(feature = "multicalc")]
pub mod multicalc;
#[cfg(feature = "naive")]
pub mod naive;
#[cfg(feature = "numeris")]
pub mod numeris;

/// Calls `$do!(name: type; …)` with every peer, by the name of its program in `bench-mcu`, and with the further arguments. The
/// feature `crazyflie` is that of the calling crate.
#[macro_export]
macro_rules! each_filter {
    ($do:ident, $($rest:tt)*) => {
        $do! {
            #[cfg(feature = "crazyflie")]
            crazyflie: $crate::filters::crazyflie::Crazyflie;
            derived: $crate::filters::derived::Plain;
            derived_stabilised: $crate::filters::derived::Stabilised;
            naive: $crate::filters::naive::Plain;
            naive_joseph: $crate::filters::naive::Joseph;
            adskalman_symmetric: $crate::filters::adskalman::Symmetric;
            adskalman: $crate::filters::adskalman::Joseph;
            kfilter: $crate::filters::kfilter::Kfilter;
            minikalman: $crate::filters::minikalman::Minikalman;
            minikalman_boxed: $crate::filters::minikalman::Boxed;
            numeris: $crate::filters::numeris::NumerisEkf;
            multicalc_passed_in: $crate::filters::multicalc::PassedIn;
            multicalc: $crate::filters::multicalc::OwnTrigonometry;
            $($rest)*
        }
    };
}
