//! Metadata as ISO 19139 has them, which CityGML of both versions takes in `gml:metaDataProperty`.

use super::xml::Xml;
use crate::cityjson::Header;
use std::io::{self, Write};

const GMD: &str = "http://www.isotc211.org/2005/gmd";
const GCO: &str = "http://www.isotc211.org/2005/gco";

/// The day of metadata whose own day was not given: dates of the run would change a result that is the same.
const UNTOLD_DAY: &str = "1970-01-01";

/// Writes what was given of the metadata, with the elements that ISO 19139 asks for; nothing if nothing was.
pub(super) fn write<W: Write>(xml: &mut Xml<W>, header: &Header) -> io::Result<()> {
    let given = &header.metadata;
    if given.is_empty() {
        return Ok(());
    }
    let day = given.reference_date.as_deref().unwrap_or(UNTOLD_DAY);
    let about = given.lineage.as_deref().unwrap_or(&header.title);
    xml.open("gml:metaDataProperty", &[])?;
    xml.open("gmd:MD_Metadata", &[("xmlns:gmd", GMD), ("xmlns:gco", GCO)])?;
    if let Some(identifier) = &given.identifier {
        text(xml, "gmd:fileIdentifier", identifier)?;
    }
    xml.open("gmd:contact", &[])?;
    xml.open("gmd:CI_ResponsibleParty", &[])?;
    text(xml, "gmd:organisationName", given.contact_name.as_deref().unwrap_or("unknown"))?;
    if let Some(email) = &given.contact_email {
        let nest = ["gmd:contactInfo", "gmd:CI_Contact", "gmd:address", "gmd:CI_Address"];
        nest.iter().try_for_each(|name| xml.open(name, &[]))?;
        text(xml, "gmd:electronicMailAddress", email)?;
        nest.iter().rev().try_for_each(|name| xml.close(name))?;
    }
    code(xml, "gmd:role", "gmd:CI_RoleCode", "pointOfContact")?;
    xml.close("gmd:CI_ResponsibleParty")?;
    xml.close("gmd:contact")?;
    date(xml, "gmd:dateStamp", day)?;
    let nest = ["gmd:identificationInfo", "gmd:MD_DataIdentification", "gmd:citation", "gmd:CI_Citation"];
    nest.iter().try_for_each(|name| xml.open(name, &[]))?;
    text(xml, "gmd:title", &header.title)?;
    xml.open("gmd:date", &[])?;
    xml.open("gmd:CI_Date", &[])?;
    date(xml, "gmd:date", day)?;
    code(xml, "gmd:dateType", "gmd:CI_DateTypeCode", "creation")?;
    xml.close("gmd:CI_Date")?;
    xml.close("gmd:date")?;
    xml.close("gmd:CI_Citation")?;
    xml.close("gmd:citation")?;
    text(xml, "gmd:abstract", about)?;
    text(xml, "gmd:language", "eng")?;
    xml.close("gmd:MD_DataIdentification")?;
    xml.close("gmd:identificationInfo")?;
    if let Some(lineage) = &given.lineage {
        xml.open("gmd:dataQualityInfo", &[])?;
        xml.open("gmd:DQ_DataQuality", &[])?;
        xml.open("gmd:scope", &[])?;
        xml.open("gmd:DQ_Scope", &[])?;
        code(xml, "gmd:level", "gmd:MD_ScopeCode", "dataset")?;
        xml.close("gmd:DQ_Scope")?;
        xml.close("gmd:scope")?;
        xml.open("gmd:lineage", &[])?;
        xml.open("gmd:LI_Lineage", &[])?;
        text(xml, "gmd:statement", lineage)?;
        for name in ["gmd:LI_Lineage", "gmd:lineage", "gmd:DQ_DataQuality", "gmd:dataQualityInfo"] {
            xml.close(name)?;
        }
    }
    xml.close("gmd:MD_Metadata")?;
    xml.close("gml:metaDataProperty")
}

fn text<W: Write>(xml: &mut Xml<W>, name: &str, text: &str) -> io::Result<()> {
    xml.open(name, &[])?;
    xml.leaf("gco:CharacterString", &[], text)?;
    xml.close(name)
}

fn date<W: Write>(xml: &mut Xml<W>, name: &str, day: &str) -> io::Result<()> {
    xml.open(name, &[])?;
    xml.leaf("gco:Date", &[], day)?;
    xml.close(name)
}

/// A value of one of the code lists of ISO 19139.
fn code<W: Write>(xml: &mut Xml<W>, name: &str, list: &str, value: &str) -> io::Result<()> {
    let at = format!("http://www.isotc211.org/2005/resources/Codelist/gmxCodelists.xml#{}", list.replace("gmd:", ""));
    xml.open(name, &[])?;
    xml.leaf(list, &[("codeList", &at), ("codeListValue", value)], value)?;
    xml.close(name)
}
