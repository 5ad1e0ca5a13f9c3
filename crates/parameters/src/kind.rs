//! What a parameter can be: numbers, switches, choices, texts, files.

use std::path::PathBuf;

/// The limits of a number, both included. Meaningless for other kinds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
}

/// Limits of a number.
#[must_use]
pub const fn within(min: f64, max: f64) -> Option<Bounds> {
    Some(Bounds { min, max })
}

/// For parameters that are not numbers.
pub const ANY: Option<Bounds> = None;

/// A type that a parameter can have.
pub trait Kind: Sized {
    /// What a user calls it: `number`, `integer`, `switch`, `choice`, `list`, `text`, `file`.
    const NAME: &'static str;

    /// The names to choose from, for switches, choices and lists.
    const CHOICES: &'static [&'static str] = &[];

    /// Reads it.
    ///
    /// # Errors
    /// What was expected.
    fn parse(text: &str) -> Result<Self, String>;

    /// Writes it so that [`Kind::parse`] reads the same value.
    fn show(&self) -> String;

    /// The number to hold against the limits.
    fn number(&self) -> Option<f64> {
        None
    }
}

impl Kind for f64 {
    const NAME: &'static str = "number";

    fn parse(text: &str) -> Result<Self, String> {
        text.parse().ok().filter(|v: &Self| v.is_finite()).ok_or_else(|| "a number such as 0.25".to_owned())
    }

    fn show(&self) -> String {
        self.to_string()
    }

    fn number(&self) -> Option<f64> {
        Some(*self)
    }
}

impl Kind for usize {
    const NAME: &'static str = "integer";

    fn parse(text: &str) -> Result<Self, String> {
        text.parse().map_err(|_| "a whole number such as 16".to_owned())
    }

    fn show(&self) -> String {
        self.to_string()
    }

    fn number(&self) -> Option<f64> {
        Some(*self as f64)
    }
}

impl Kind for bool {
    const NAME: &'static str = "switch";
    const CHOICES: &'static [&'static str] = &["true", "false"];

    fn parse(text: &str) -> Result<Self, String> {
        match text {
            "true" | "on" | "yes" => Ok(true),
            "false" | "off" | "no" => Ok(false),
            _ => Err("true or false".to_owned()),
        }
    }

    fn show(&self) -> String {
        self.to_string()
    }
}

impl Kind for String {
    const NAME: &'static str = "text";

    fn parse(text: &str) -> Result<Self, String> {
        Ok(text.trim().to_owned())
    }

    fn show(&self) -> String {
        self.clone()
    }
}

/// A file that may be left out; the empty text stands for none.
impl Kind for Option<PathBuf> {
    const NAME: &'static str = "file";

    fn parse(text: &str) -> Result<Self, String> {
        let text = text.trim();
        Ok((!text.is_empty()).then(|| PathBuf::from(text)))
    }

    fn show(&self) -> String {
        self.as_ref().map(|p| p.display().to_string()).unwrap_or_default()
    }
}

/// A [`Kind`] that is chosen by name, made by [`choices!`](crate::choices).
pub trait Choice: Kind + Copy + Ord {
    /// The name by which a user chooses it.
    fn chosen_by(self) -> &'static str;
}

/// A list of choices, without repetition, in the order in which they are declared.
impl<C: Choice> Kind for Vec<C> {
    const NAME: &'static str = "list";
    const CHOICES: &'static [&'static str] = C::CHOICES;

    fn parse(text: &str) -> Result<Self, String> {
        let parts = text.split(',').map(str::trim).filter(|p| !p.is_empty());
        let mut chosen: Self = parts
            .map(C::parse)
            .collect::<Result<_, _>>()
            .map_err(|expected| format!("{expected}, several joined by commas"))?;
        chosen.sort_unstable();
        chosen.dedup();
        if chosen.is_empty() { Err(format!("at least one of {}", C::CHOICES.join(", "))) } else { Ok(chosen) }
    }

    fn show(&self) -> String {
        self.iter().map(|choice| choice.chosen_by()).collect::<Vec<_>>().join(",")
    }
}

/// Declares an enum whose variants a user chooses by name.
#[macro_export]
macro_rules! choices {
    ($(#[$meta:meta])* $visibility:vis enum $Type:ident { $($(#[$variant_meta:meta])* $Variant:ident = $name:literal,)+ }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        $visibility enum $Type {
            $($(#[$variant_meta])* $Variant,)+
        }

        impl $Type {
            /// The name by which a user chooses it.
            #[must_use]
            $visibility fn name(self) -> &'static str {
                match self { $(Self::$Variant => $name,)+ }
            }
        }

        impl $crate::Kind for $Type {
            const NAME: &'static str = "choice";
            const CHOICES: &'static [&'static str] = &[$($name),+];

            fn parse(text: &str) -> Result<Self, String> {
                match text.trim().to_ascii_lowercase().as_str() {
                    $($name => Ok(Self::$Variant),)+
                    _ => Err(format!("one of {}", <Self as $crate::Kind>::CHOICES.join(", "))),
                }
            }

            fn show(&self) -> String {
                self.name().to_owned()
            }
        }

        impl $crate::Choice for $Type {
            fn chosen_by(self) -> &'static str {
                self.name()
            }
        }
    };
}
