//! Parameters of a scene. Each is declared once, as a row of [`parameters!`]. Scene files, checks, hashes, headers of images, saved scenes,
//! C and Python read the row.

use super::{Bands, validate::Part};
use crate::Result;

/// What is known of a parameter, whatever its value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// The name in Rust, scene files, C and Python, with its unit.
    pub name: &'static str,
    pub kind: ParameterKind,
    /// Whether it may be without a value.
    pub is_optional: bool,
    /// Of numbers and counts; `None`: all that the kind allows.
    pub limits: Option<Limits>,
    /// A line of a scene file that shows it, for a parameter that every scene must give.
    pub example: Option<&'static str>,
    /// One or more sentences.
    pub meaning: &'static str,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ParameterKind {
    /// A finite number.
    Number,
    /// Width and height.
    Pair,
    /// A number for each band.
    Bands,
    /// k1, k2 and k3 of a polynomial.
    Coefficients,
    /// A whole number that fits a `u32`.
    Count,
    /// A whole number that fits a `u64`.
    LargeCount,
    Flag,
    /// One of these names.
    Name(&'static [&'static str]),
}

/// The value of a parameter. It is of the parameter's kind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ParameterValue {
    Number(f64),
    Pair([f64; 2]),
    Bands(Bands),
    Coefficients([f64; 3]),
    Count(u64),
    Name(&'static str),
    Flag(bool),
}

/// The values that a parameter may have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    pub least: f64,
    pub most: f64,
    /// Whether `least` itself is refused.
    pub is_above: bool,
    /// What to give instead of another value.
    pub hint: &'static str,
}

impl Limits {
    pub(crate) const fn between(least: f64, most: f64, hint: &'static str) -> Self {
        Limits {
            least,
            most,
            is_above: false,
            hint,
        }
    }

    /// Above 0, up to `most`.
    pub(crate) const fn positive(most: f64, hint: &'static str) -> Self {
        Limits {
            is_above: true,
            ..Limits::between(0.0, most, hint)
        }
    }

    pub fn contains(&self, value: f64) -> bool {
        (self.least..=self.most).contains(&value) && !(self.is_above && value == self.least)
    }
}

impl ParameterValue {
    /// A number or a count.
    pub fn number(self) -> Option<f64> {
        match self {
            ParameterValue::Number(number) => Some(number),
            ParameterValue::Count(count) => Some(count as f64),
            _ => None,
        }
    }
}

impl std::fmt::Display for ParameterValue {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            ParameterValue::Number(number) => write!(f, "{number}"),
            ParameterValue::Pair(numbers) => write!(f, "{numbers:?}"),
            ParameterValue::Bands(numbers) | ParameterValue::Coefficients(numbers) => {
                write!(f, "{numbers:?}")
            }
            ParameterValue::Count(count) => write!(f, "{count}"),
            ParameterValue::Name(name) => write!(f, "{name}"),
            ParameterValue::Flag(flag) => write!(f, "{flag}"),
        }
    }
}

/// A type that parameters have.
pub(crate) trait ParameterType {
    const KIND: ParameterKind;
    const IS_OPTIONAL: bool = false;

    fn get(&self) -> Option<ParameterValue>;

    /// The value is of this kind.
    fn set(&mut self, value: ParameterValue);
}

macro_rules! parameter_type {
    ($($type:ty, $kind:expr, $variant:ident;)+) => {$(
        impl ParameterType for $type {
            const KIND: ParameterKind = $kind;

            fn get(&self) -> Option<ParameterValue> {
                Some(ParameterValue::$variant((*self).into()))
            }

            fn set(&mut self, value: ParameterValue) {
                if let ParameterValue::$variant(value) = value
                    && let Ok(value) = value.try_into()
                {
                    *self = value;
                }
            }
        }
    )+};
}

parameter_type! {
    f64, ParameterKind::Number, Number;
    [f64; 2], ParameterKind::Pair, Pair;
    Bands, ParameterKind::Bands, Bands;
    u32, ParameterKind::Count, Count;
    u64, ParameterKind::LargeCount, Count;
    bool, ParameterKind::Flag, Flag;
}

impl<T: ParameterType + Default> ParameterType for Option<T> {
    const KIND: ParameterKind = T::KIND;
    const IS_OPTIONAL: bool = true;

    fn get(&self) -> Option<ParameterValue> {
        self.as_ref().and_then(T::get)
    }

    fn set(&mut self, value: ParameterValue) {
        self.insert(T::default()).set(value);
    }
}

/// A struct whose fields are parameters.
pub trait Parameters {
    /// The name of the struct.
    fn name(&self) -> &'static str;

    /// What the struct is, in one or more sentences.
    fn about(&self) -> &'static str;

    /// A row for each field, in the order of the fields.
    fn rows(&self) -> &'static [Parameter];

    /// In the order of the rows; `None` for an optional parameter without a value.
    fn values(&self) -> Vec<Option<ParameterValue>>;

    /// Sets the parameter of this row to a value of its kind.
    fn set(&mut self, row: usize, value: ParameterValue);

    /// Each parameter with its value.
    fn named_values(&self) -> Vec<(&'static Parameter, Option<ParameterValue>)> {
        self.rows().iter().zip(self.values()).collect()
    }
}

impl dyn Parameters + '_ {
    /// Sets each parameter for which `read` finds a value; the others stay.
    ///
    /// # Errors
    /// The first of `read`.
    pub fn read<E>(
        &mut self,
        mut read: impl FnMut(&'static Parameter) -> std::result::Result<Option<ParameterValue>, E>,
    ) -> std::result::Result<(), E> {
        for (row, parameter) in self.rows().iter().enumerate() {
            if let Some(value) = read(parameter)? {
                self.set(row, value);
            }
        }
        Ok(())
    }
}

/// Refuses values beyond the limits of their parameters.
pub(super) fn check_limits(part: &Part, parameters: &dyn Parameters) -> Result<()> {
    for (parameter, value) in parameters.named_values() {
        let (Some(limits), Some(value)) = (parameter.limits, value) else {
            continue;
        };
        let numbers = match value {
            ParameterValue::Pair([width, height]) => {
                [(" width", width), (" height", height)].to_vec()
            }
            ParameterValue::Bands(bands) => {
                let names = [" of R", " of G", " of B"];
                names.into_iter().zip(bands).collect()
            }
            ParameterValue::Coefficients(coefficients) => [" k1", " k2", " k3"]
                .into_iter()
                .zip(coefficients)
                .collect(),
            value => value
                .number()
                .map(|number| ("", number))
                .into_iter()
                .collect(),
        };
        for (of, number) in numbers {
            let problem = format_args!("{}{of} is {number}", parameter.name);
            part.require(limits.contains(number), problem, limits.hint)?;
        }
    }
    Ok(())
}

/// Declares a struct of parameters. A row has documentation, which is the parameter's meaning, name, type and default; then, if there are
/// any, its limits, and an example of a parameter that every scene must give. After `with`: fields that are structs of parameters of their
/// own.
macro_rules! parameters {
    (
        $(#[doc = $about:literal])+
        pub struct $Struct:ident {$(
            $(#[doc = $meaning:literal])+
            $name:ident: $type:ty = $default:expr $(, $limits:expr)? $(; needs $example:literal)?;
        )+}
        $(with {$(
            $(#[doc = $of_part:literal])+
            $part:ident: Option<$part_type:ty>;
        )+})?
    ) => {
        $(#[doc = $about])+
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct $Struct {$(
            $(#[doc = $meaning])+
            pub $name: $type,
        )+
        $($(
            $(#[doc = $of_part])+
            pub $part: Option<$part_type>,
        )+)?}

        impl $Struct {
            /// The values where nothing else is given.
            pub const DEFAULT: Self = $Struct { $($name: $default,)+ $($($part: None,)+)? };
        }

        impl $crate::scene::Parameters for $Struct {
            fn name(&self) -> &'static str {
                stringify!($Struct)
            }

            fn about(&self) -> &'static str {
                concat!($($about),+)
            }

            fn rows(&self) -> &'static [$crate::scene::Parameter] {
                use $crate::scene::parameters::ParameterType;
                const ROWS: &[$crate::scene::Parameter] = &[$({
                    #[allow(unused_mut, unused_assignments)]
                    let (mut limits, mut example) = (None, None);
                    $(limits = Some($limits);)?
                    $(example = Some($example);)?
                    $crate::scene::Parameter {
                        name: stringify!($name),
                        kind: <$type>::KIND,
                        is_optional: <$type>::IS_OPTIONAL,
                        limits,
                        example,
                        meaning: concat!($($meaning),+),
                    }
                }),+];
                ROWS
            }

            fn values(&self) -> Vec<Option<$crate::scene::ParameterValue>> {
                use $crate::scene::parameters::ParameterType;
                vec![$(self.$name.get()),+]
            }

            fn set(&mut self, row: usize, value: $crate::scene::ParameterValue) {
                use $crate::scene::parameters::ParameterType;
                let fields: &mut [&mut dyn FnMut($crate::scene::ParameterValue)] =
                    &mut [$(&mut |value| self.$name.set(value)),+];
                fields[row](value);
            }
        }
    };
}
pub(super) use parameters;
