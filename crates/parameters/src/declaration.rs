//! Parameters as their owner declares them.

use crate::kind::Bounds;

/// One parameter, as its owner declares it.
#[derive(Debug)]
pub struct Declaration {
    /// Its name, without that of a group.
    pub name: &'static str,
    /// `number`, `integer`, `switch`, `choice`, `list`, `text` or `file`.
    pub kind: &'static str,
    /// Unit, empty for bare numbers and all that is no number.
    pub unit: &'static str,
    /// Limits, for numbers.
    pub bounds: Option<Bounds>,
    /// What can be chosen, for switches, choices and lists.
    pub choices: &'static [&'static str],
    /// One line of help.
    pub help: &'static str,
    /// Whether few users need it: a constant that decides quality, rather than a wish.
    pub is_expert: bool,
    /// The default, as text.
    pub default: fn() -> String,
    /// Reads a text; use [`Declaration::read`], which holds it against the limits.
    #[doc(hidden)]
    pub parse: fn(&str) -> Result<Reading, String>,
}

/// A value that was read.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// The value as it is written: equal values are equal texts.
    pub text: String,
    /// The value, for numbers.
    pub number: Option<f64>,
}

/// Why a text is no value of a parameter.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Wrong {
    /// It is of another kind.
    #[error("give {expected}")]
    Kind {
        /// What the parameter takes.
        expected: String,
    },
    /// It is outside the limits.
    #[error("{value} is not from {} to {}", .bounds.min, .bounds.max)]
    Range {
        /// The value.
        value: f64,
        /// The limits.
        bounds: Bounds,
    },
}

impl Declaration {
    /// Reads a value and holds it against the limits.
    ///
    /// # Errors
    /// If the text is of another kind or the number outside the limits.
    pub fn read(&self, text: &str) -> Result<Reading, Wrong> {
        let reading = (self.parse)(text.trim()).map_err(|expected| Wrong::Kind { expected })?;
        match (self.bounds, reading.number) {
            (Some(bounds), Some(value)) if !(bounds.min..=bounds.max).contains(&value) => {
                Err(Wrong::Range { value, bounds })
            }
            _ => Ok(reading),
        }
    }
}

/// A struct of parameters, made by [`parameters!`](crate::parameters).
pub trait Parameters: Default {
    /// Its parameters, in the order of declaration.
    fn declarations() -> &'static [Declaration];

    /// The value of a parameter as text; `None` if there is none of this name.
    fn value(&self, name: &str) -> Option<String>;

    /// Sets a parameter that has been declared; the limits are not looked at.
    ///
    /// # Errors
    /// What was expected; also if there is no such parameter.
    fn set(&mut self, name: &str, text: &str) -> Result<(), String>;
}

/// Declares a struct of parameters with their defaults, units, limits and help.
///
/// See the crate's page for an example.
#[macro_export]
macro_rules! parameters {
    (@is_expert) => { false };
    (@is_expert expert) => { true };
    (
        $(#[$meta:meta])*
        $visibility:vis struct $Type:ident {
            $(#[doc = $help:literal] $name:ident: $Kind:ty = $default:expr, $unit:literal, $bounds:expr $(, $level:ident)?;)*
        }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Debug, PartialEq)]
        $visibility struct $Type {
            $(#[doc = $help] pub $name: $Kind,)*
        }

        impl Default for $Type {
            fn default() -> Self {
                Self { $($name: $default,)* }
            }
        }

        impl $crate::Parameters for $Type {
            fn declarations() -> &'static [$crate::Declaration] {
                static DECLARATIONS: &[$crate::Declaration] = &[$($crate::Declaration {
                    name: stringify!($name),
                    kind: <$Kind as $crate::Kind>::NAME,
                    unit: $unit,
                    bounds: $bounds,
                    choices: <$Kind as $crate::Kind>::CHOICES,
                    help: $help.trim_ascii(),
                    is_expert: $crate::parameters!(@is_expert $($level)?),
                    default: || {
                        let default: $Kind = $default;
                        $crate::Kind::show(&default)
                    },
                    parse: |text| {
                        let value = <$Kind as $crate::Kind>::parse(text)?;
                        Ok($crate::Reading {
                            text: $crate::Kind::show(&value),
                            number: $crate::Kind::number(&value),
                        })
                    },
                },)*];
                DECLARATIONS
            }

            fn value(&self, name: &str) -> Option<String> {
                match name {
                    $(stringify!($name) => Some($crate::Kind::show(&self.$name)),)*
                    _ => None,
                }
            }

            fn set(&mut self, name: &str, text: &str) -> Result<(), String> {
                match name {
                    $(stringify!($name) => self.$name = $crate::Kind::parse(text)?,)*
                    _ => return Err(format!("a parameter that there is, not {name}: {text}")),
                }
                Ok(())
            }
        }
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::within;

    crate::choices! {
        /// A way.
        pub(crate) enum Way {
            /// Round about.
            Long = "long",
            /// Straight on.
            Short = "short",
        }
    }

    crate::parameters! {
        /// Parameters of a test.
        struct TestParams {
            /// How long.
            length: f64 = 1.5, "m", within(0.0, 2.0);
            /// How often.
            count: usize = 3, "", within(1.0, 9.0), expert;
            /// Which way.
            way: Way = Way::Short, "", None;
        }
    }

    #[test]
    fn a_declaration_says_all_of_a_parameter() {
        let [length, count, way] = TestParams::declarations() else { panic!("three parameters") };
        assert_eq!((length.name, length.kind, length.unit, length.help), ("length", "number", "m", "How long."));
        assert_eq!((length.is_expert, count.is_expert), (false, true));
        assert_eq!(way.choices, ["long", "short"]);
        assert_eq!([length, count, way].map(|d| (d.default)()), ["1.5", "3", "short"]);
    }

    #[test]
    fn what_is_read_is_held_against_kind_and_limits() {
        let [length, count, way] = TestParams::declarations() else { panic!("three parameters") };
        assert_eq!(length.read(" 1.50 ").unwrap().text, "1.5", "equal values are equal texts");
        assert_eq!(length.read("3"), Err(Wrong::Range { value: 3.0, bounds: Bounds { min: 0.0, max: 2.0 } }));
        assert_eq!(count.read("1.5"), Err(Wrong::Kind { expected: "a whole number such as 16".to_owned() }));
        assert_eq!(way.read("LONG").unwrap().text, "long");
        assert!(length.read("NaN").is_err() && length.read("inf").is_err());
    }

    #[test]
    fn values_are_set_and_shown_by_name() {
        let mut params = TestParams::default();
        params.set("way", "long").unwrap();
        assert_eq!((params.way, params.value("way").as_deref()), (Way::Long, Some("long")));
        assert_eq!(params.value("width"), None);
        assert!(params.set("width", "1").unwrap_err().contains("width"));
    }
}
