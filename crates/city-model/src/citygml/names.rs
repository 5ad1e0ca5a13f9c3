//! Names that CityGML asks for: identifiers, code lists, units.

use std::fmt::Write;

/// SIG3D's code list for roof types, to which the codes belong.
pub(super) const ROOF_TYPE_LIST: &str =
    "http://www.sig3d.org/codelists/standard/building/2.0/_AbstractBuilding_roofType.xml";

/// Roof types of the list under the names that gable gives them.
const ROOF_TYPES: [(&str, &str); 14] = [
    ("flat", "1000"),
    ("monopitch", "1010"),
    ("dual pent", "1020"),
    ("gabled", "1030"),
    ("hipped", "1040"),
    ("half-hipped", "1050"),
    ("mansard", "1060"),
    ("pavilion", "1070"),
    ("cone", "1080"),
    ("dome", "1090"),
    ("shed", "1100"),
    ("arch", "1110"),
    ("pyramidal", "1120"),
    ("combination", "1130"),
];

/// Code of a roof type's name; other names have none.
pub(super) fn roof_type_code(name: &str) -> Option<&'static str> {
    ROOF_TYPES.iter().find(|(known, _)| *known == name).map(|&(_, code)| code)
}

/// Name of a roof type's code.
pub(super) fn roof_type_name(code: &str) -> Option<&'static str> {
    ROOF_TYPES.iter().find(|(_, known)| *known == code).map(|&(name, _)| name)
}

/// Unit that the end of an attribute's name says.
pub(super) fn unit(name: &str) -> Option<&'static str> {
    match name.rsplit_once('_')?.1 {
        "m" => Some("m"),
        "m2" => Some("m2"),
        "m3" => Some("m3"),
        "deg" => Some("deg"),
        _ => None,
    }
}

/// An identifier as `gml:id`, which must be an XML name without a colon: letters, digits, `-`, `.` and `_` stay, any
/// other character becomes `_x…_` with its hexadecimal code; a digit, `-` or `.` in front gets `_` before it.
pub(super) fn gml_id(id: &str) -> String {
    let mut out = String::with_capacity(id.len() + 1);
    if !id.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') {
        out.push('_');
    }
    for c in id.chars() {
        if c.is_ascii_alphanumeric() || "-._".contains(c) {
            out.push(c);
        } else {
            // Writing to a string cannot fail.
            let _ = write!(out, "_x{:x}_", u32::from(c));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn identifiers() {
        assert_eq!(gml_id("NL.IMBAG.Pand.0503100000012869-0"), "NL.IMBAG.Pand.0503100000012869-0");
        assert_eq!(gml_id("{1136AF85}"), "__x7b_1136AF85_x7d_");
        assert_eq!(gml_id("12:é"), "_12_x3a__xe9_");
        assert_eq!(gml_id(""), "_");
    }

    #[test]
    fn units() {
        assert_eq!(unit("volume_m3"), Some("m3"));
        assert_eq!(unit("slope_deg"), Some("deg"));
        assert_eq!((unit("roof_planes"), unit("m")), (None, None));
    }
}
