//! Enums whose values are stored, shown and sent under fixed names.

/// Declares such an enum: `name()` gives the name of a value, `parse()` the value of a name, and serde uses the same names.
macro_rules! named {
    ($(#[$about:meta])* $name:ident, $what:literal, { $($(#[$each:meta])* $variant:ident = $text:literal,)+ }) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
        pub enum $name {
            $($(#[$each])* #[serde(rename = $text)] $variant,)+
        }

        impl $name {
            /// All of them, in order.
            pub const ALL: &'static [Self] = &[$(Self::$variant),+];

            /// The name under which it is stored and shown.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $text,)+
                }
            }
        }

        impl std::str::FromStr for $name {
            type Err = crate::JobStoreError;

            fn from_str(text: &str) -> Result<Self, Self::Err> {
                match text {
                    $($text => Ok(Self::$variant),)+
                    _ => Err(crate::JobStoreError::Stored { what: $what, value: text.to_owned() }),
                }
            }
        }
    };
}

pub(crate) use named;

#[cfg(test)]
mod tests {
    use crate::{EventKind, JobState};

    #[test]
    fn names_go_both_ways() {
        for state in JobState::ALL {
            assert_eq!(state.name().parse::<JobState>().ok(), Some(*state));
            assert_eq!(serde_json::to_value(state).ok(), Some(state.name().into()));
        }
        assert!("Running".parse::<JobState>().is_err());
        assert_eq!(
            "lost".parse::<EventKind>().map_err(|e| e.to_string()),
            Err("kind of an event in the database cannot be read: \"lost\"".to_owned())
        );
    }
}
