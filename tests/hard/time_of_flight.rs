//! Hard cases: `src/hard_cases/time_of_flight.rs`.
#![cfg(feature = "reference")]

hard_cases! {
    camlux::hard_cases::time_of_flight::CASES;
    range_just_below_and_above_its_period,
    two_lights_in_antiphase,
    pixels_that_see_the_bounce_alone,
    saturated_taps,
    modulated_light_50_km_away,
    ten_kilometres_at_100_mhz,
}
