//! The one list of parameters, and how a run's values are put together.
//!
//! Values come, later over earlier, from the defaults, a preset, a config file and single settings
//! ([`Params::assemble`]). Each parameter is declared once: in `table.rs` those of the stages, beside each method its own.

mod kind;
mod own;
mod parameter;
mod preset;
mod registry;
mod table;

pub use kind::{Features, Format, TerrainModel, Up};
pub use parameter::{Parameter, parameters};
pub use preset::{PRESETS, Preset};
pub use registry::{InstalledTooLate, Registry};
pub use table::{
    GROUPS, GridParams, InputParams, ModelingParams, OutputParams, Params, ResourceParams, SamplingParams,
    SegmentationParams, ValidationParams,
};

use gable_city_model::Metadata;
use gable_geometry::Crs;
use gable_modeling::Reconstruction;
use gable_parameters::Settings;
use gable_segmentation::Labeller;
use own::OwnSetting;
use parameter::{LABELLING, RECONSTRUCTION, resolve};

/// A parameter that does not hold. Each message says what to do.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ParamError {
    /// No parameter bears this name.
    #[error("there is no parameter {name:?}{}; `gable params` lists all", did_you_mean(.suggestion))]
    Unknown {
        /// The name given.
        name: String,
        /// The nearest name that exists.
        suggestion: Option<String>,
    },
    /// Several parameters bear this short name.
    #[error("the name {name:?} is short for {}: write one of them in full", .candidates.join(" and "))]
    Ambiguous {
        /// The name given.
        name: String,
        /// The full names that it could stand for.
        candidates: Vec<String>,
    },
    /// The value is of another kind.
    #[error("{name} = {value:?} cannot be read: give {expected}")]
    Value {
        /// Full name.
        name: String,
        /// The value given.
        value: String,
        /// What the parameter takes.
        expected: String,
    },
    /// The value is outside the limits.
    #[error("{name} = {value} is out of range: give {min} to {max}{}", unit_suffix(.unit))]
    Range {
        /// Full name.
        name: String,
        /// The value given.
        value: f64,
        /// Smallest.
        min: f64,
        /// Largest.
        max: f64,
        /// Unit.
        unit: String,
    },
    /// The value is that of a method which was not chosen.
    #[error("{name} belongs to {}: the method of {group} is {chosen}, which has no such parameter", methods_in_words(.methods))]
    OtherMethod {
        /// Full name.
        name: String,
        /// The methods that have it.
        methods: Vec<String>,
        /// Its group.
        group: String,
        /// The method that was chosen.
        chosen: String,
    },
    /// No preset bears this name.
    #[error("there is no preset {name:?}{}: the presets are {}", did_you_mean(.suggestion), preset_names())]
    Preset {
        /// The name given.
        name: String,
        /// The nearest name that exists.
        suggestion: Option<String>,
    },
    /// The config file is no TOML.
    #[error("the config file cannot be read: {0}")]
    Config(String),
    /// Two values do not go together.
    #[error("{0}")]
    Together(String),
}

fn did_you_mean(suggestion: &Option<String>) -> String {
    suggestion.as_ref().map(|s| format!(" (did you mean {s:?}?)")).unwrap_or_default()
}

fn unit_suffix(unit: &str) -> String {
    if unit.is_empty() { String::new() } else { format!(" {unit}") }
}

fn methods_in_words(methods: &[String]) -> String {
    let word = if methods.len() == 1 { "the method" } else { "the methods" };
    format!("{word} {}", methods.join(" and "))
}

fn preset_names() -> String {
    PRESETS.iter().map(|p| p.name).collect::<Vec<_>>().join(", ")
}

/// The candidate most like `name`, if any is like it at all.
fn nearest<'a>(name: &str, candidates: impl Iterator<Item = &'a str>) -> Option<String> {
    let likeness = |full: &str| {
        let short = full.rsplit('.').next().unwrap_or(full);
        strsim::jaro_winkler(name, full).max(strsim::jaro_winkler(name, short))
    };
    candidates
        .map(|c| (likeness(c), c))
        .filter(|(score, _)| *score > 0.75)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, c)| c.to_owned())
}

impl Params {
    /// The values of a run: defaults, then `preset` (or the config's `preset`), then the config file, then
    /// single settings. The result is checked.
    ///
    /// # Errors
    /// A name that does not exist, or a value of the wrong kind, out of range or in conflict with another.
    pub fn assemble(
        preset: Option<&str>,
        config: Option<&str>,
        settings: &[(String, String)],
    ) -> Result<Self, ParamError> {
        let mut params = Self::default();
        let (config_preset, config_settings) = config.map(read_config).transpose()?.unwrap_or_default();
        if let Some(name) = preset.map(str::to_owned).or(config_preset) {
            params.apply_preset(&name)?;
        }
        for (name, value) in config_settings.iter().chain(settings) {
            params.set(name, value)?;
        }
        params.check()?;
        Ok(params)
    }

    /// Takes over the values of a preset.
    ///
    /// # Errors
    /// If there is no such preset.
    pub fn apply_preset(&mut self, name: &str) -> Result<(), ParamError> {
        let Some(preset) = PRESETS.iter().find(|p| p.name == name) else {
            let suggestion = nearest(name, PRESETS.iter().map(|p| p.name));
            return Err(ParamError::Preset { name: name.to_owned(), suggestion });
        };
        preset.values.iter().try_for_each(|(name, value)| self.set_as(name, value, true))
    }

    /// Sets one parameter by its full name, or by the last part of it where that is unique. `method` alone sets the
    /// method of every stage, and to `zhu2018` with the published figures: it stands for the preset.
    ///
    /// # Errors
    /// If there is no such parameter, or the value is of another kind or out of range.
    pub fn set(&mut self, name: &str, value: &str) -> Result<(), ParamError> {
        self.set_as(name, value, false)
    }

    fn set_as(&mut self, name: &str, value: &str, is_of_preset: bool) -> Result<(), ParamError> {
        if name.trim() == "method" {
            return self.set_method(value.trim());
        }
        for parameter in resolve(name)? {
            let text = parameter.read(self, value.trim())?;
            if parameter.methods.is_empty() {
                self.set_stage_value(parameter.group, parameter.short_name(), &text).map_err(|expected| {
                    ParamError::Value { name: parameter.name.clone(), value: value.to_owned(), expected }
                })?;
            } else {
                self.own.insert(&parameter.name, OwnSetting { text, is_of_preset });
            }
        }
        Ok(())
    }

    /// Sets the method of every stage that has one of this name.
    fn set_method(&mut self, name: &str) -> Result<(), ParamError> {
        if PRESETS.iter().any(|preset| preset.name == name && preset.is_method) {
            return self.apply_preset(name);
        }
        let mut refused = None;
        let mut is_known = false;
        for parameter in resolve("method")? {
            match parameter.read(self, name) {
                Ok(text) => {
                    is_known = true;
                    self.set(&parameter.name, &text)?;
                }
                Err(error) => refused = Some(error),
            }
        }
        match refused {
            Some(error) if !is_known => Err(error),
            _ => Ok(()),
        }
    }

    /// The name of the method that a group's stage follows; empty for a stage without methods.
    pub(crate) fn method_of(&self, group: &str) -> &str {
        match group {
            LABELLING => &self.segmentation.method,
            RECONSTRUCTION => &self.modeling.method,
            _ => "",
        }
    }

    /// The method of labelling, with what was set of its own parameters.
    ///
    /// # Errors
    /// If there is no such method.
    pub fn labeller(&self) -> Result<(&'static dyn Labeller, Settings), ParamError> {
        let method = Registry::get().labeller(&self.segmentation.method);
        Ok((method.ok_or_else(|| self.no_method(LABELLING))?, self.own_settings(LABELLING)))
    }

    /// The method of reconstruction, with what was set of its own parameters.
    ///
    /// # Errors
    /// If there is no such method.
    pub fn reconstruction(&self) -> Result<(&'static dyn Reconstruction, Settings), ParamError> {
        let method = Registry::get().reconstruction(&self.modeling.method);
        Ok((method.ok_or_else(|| self.no_method(RECONSTRUCTION))?, self.own_settings(RECONSTRUCTION)))
    }

    fn no_method(&self, group: &str) -> ParamError {
        let choices = parameters().iter().find(|p| p.group == group && p.short_name() == "method");
        let names = choices.map(|p| p.choices.join(", ")).unwrap_or_default();
        ParamError::Value {
            name: format!("{group}.method"),
            value: self.method_of(group).to_owned(),
            expected: format!("one of {names}"),
        }
    }

    /// What was set of the parameters that the chosen method of a group has.
    fn own_settings(&self, group: &str) -> Settings {
        let mut settings = Settings::default();
        for parameter in parameters().iter().filter(|p| p.group == group && !p.methods.is_empty() && p.applies(self)) {
            if let Some(setting) = self.own.get(&parameter.name) {
                settings.insert(parameter.short_name(), &setting.text);
            }
        }
        settings
    }

    /// Checks the values of methods' own parameters: each belongs to a method that is chosen, and holds its limits.
    fn check_own(&self) -> Result<(), ParamError> {
        for (name, setting) in self.own.iter() {
            for parameter in resolve(name)? {
                if parameter.applies(self) {
                    parameter.read(self, &setting.text)?;
                } else if !setting.is_of_preset {
                    return Err(ParamError::OtherMethod {
                        name: name.clone(),
                        methods: parameter.methods.iter().map(|method| (*method).to_owned()).collect(),
                        group: parameter.group.to_owned(),
                        chosen: self.method_of(parameter.group).to_owned(),
                    });
                }
            }
        }
        Ok(())
    }

    /// The reference system that the user asked for; `None` to take what the input says.
    ///
    /// # Errors
    /// If it cannot be understood.
    pub fn crs(&self) -> Result<Option<Crs>, ParamError> {
        match self.input.crs.as_str() {
            "auto" => Ok(None),
            text => text.parse().map(Some).map_err(|_| ParamError::Value {
                name: "input.crs".to_owned(),
                value: text.to_owned(),
                expected: "EPSG:7415, EPSG:25832+7837, ENU:latitude,longitude, or auto".to_owned(),
            }),
        }
    }

    /// What the user wants to be added to the coordinates; `None` to take what files beside the mesh say.
    ///
    /// # Errors
    /// If it is not three numbers, or two for a height of 0.
    pub fn origin(&self) -> Result<Option<[f64; 3]>, ParamError> {
        if self.input.origin == "auto" {
            return Ok(None);
        }
        let parts = self.input.origin.split([',', ';', ' ']).map(str::trim).filter(|part| !part.is_empty());
        let numbers: Option<Vec<f64>> = parts.map(|n| n.parse().ok().filter(|v: &f64| v.is_finite())).collect();
        match numbers.as_deref() {
            Some(&[x, y]) => Ok(Some([x, y, 0.0])),
            Some(&[x, y, z]) => Ok(Some([x, y, z])),
            _ => Err(ParamError::Value {
                name: "input.origin".to_owned(),
                value: self.input.origin.clone(),
                expected: "x,y,z such as 691000,5334000,0, or auto".to_owned(),
            }),
        }
    }

    /// The height of the zero of heights above the ellipsoid that the user gives, metres; `None` to take it from the reference system.
    ///
    /// # Errors
    /// If it is no height.
    pub fn geoid(&self) -> Result<Option<f64>, ParamError> {
        match self.output.geoid.as_str() {
            "auto" => Ok(None),
            text => match text.parse::<f64>() {
                Ok(height) if height.abs() <= 10_000.0 => Ok(Some(height)),
                _ => Err(ParamError::Value {
                    name: "output.geoid".to_owned(),
                    value: text.to_owned(),
                    expected: "metres such as 43.2, or auto".to_owned(),
                }),
            },
        }
    }

    /// Whether the ground is written with its picture on it.
    #[must_use]
    pub(crate) fn drapes_ground(&self) -> bool {
        self.output.terrain && self.output.formats.contains(&Format::Tiles3d)
    }

    /// Whether the mesh is written for viewers.
    #[must_use]
    pub(crate) fn shows_mesh(&self) -> bool {
        self.output.formats.contains(&Format::MeshTiles3d)
    }

    /// What the data set tells of itself.
    #[must_use]
    pub(crate) fn metadata(&self) -> Metadata {
        let given = |text: &String| (!text.is_empty()).then(|| text.clone());
        Metadata {
            identifier: given(&self.output.identifier),
            reference_date: given(&self.output.reference_date),
            contact_name: given(&self.output.contact_name),
            contact_email: given(&self.output.contact_email),
            lineage: given(&self.output.lineage),
        }
    }

    /// Checks every limit, and what has to go together.
    ///
    /// # Errors
    /// The first value that does not hold.
    pub fn check(&self) -> Result<(), ParamError> {
        for parameter in parameters().iter().filter(|p| p.methods.is_empty()) {
            parameter.read(self, &parameter.value(self))?;
        }
        self.check_own()?;
        if let Some(crs) = self.crs()? {
            gable_reference_systems::metric(&crs).map_err(|e| ParamError::Together(format!("input.crs = {e}")))?;
        }
        self.origin()?;
        self.geoid()?;
        self.check_metadata()?;
        let block = self.grid.block_size;
        if block > 0.0 && block < 10.0 * self.sampling.step {
            return Err(ParamError::Together(format!(
                "grid.block_size = {block} m is less than ten pixels of {} m: use larger blocks or a smaller sampling.step",
                self.sampling.step
            )));
        }
        if 2 * self.segmentation.margin > self.segmentation.patch {
            return Err(ParamError::Together(format!(
                "segmentation.margin = {} px is more than half of segmentation.patch = {} px: make one smaller or the other larger",
                self.segmentation.margin, self.segmentation.patch
            )));
        }
        Ok(())
    }

    /// Checks what the data set tells of itself.
    fn check_metadata(&self) -> Result<(), ParamError> {
        let output = &self.output;
        let texts = [
            ("output.title", &output.title),
            ("output.identifier", &output.identifier),
            ("output.contact_name", &output.contact_name),
            ("output.contact_email", &output.contact_email),
            ("output.lineage", &output.lineage),
        ];
        if let Some((name, text)) = texts.into_iter().find(|(_, text)| text.chars().any(char::is_control)) {
            return Err(ParamError::Value {
                name: name.to_owned(),
                value: format!("{text:?}"),
                expected: "a text of one line".to_owned(),
            });
        }
        if output.contact_name.is_empty() != output.contact_email.is_empty() {
            let reason = "output.contact_name and output.contact_email go together: CityJSON asks for both";
            return Err(ParamError::Together(reason.to_owned()));
        }
        let day = &output.reference_date;
        if !day.is_empty() && !is_day(day) {
            return Err(ParamError::Value {
                name: "output.reference_date".to_owned(),
                value: day.clone(),
                expected: "a day such as 2025-06-30".to_owned(),
            });
        }
        Ok(())
    }

    /// The values of `groups` as text, one `name=value` line each, in the order of declaration: equal texts
    /// mean equal results, so this is what to hash. The group `resources` is left out even if named, because
    /// nothing of the result depends on it.
    #[must_use]
    pub fn canonical(&self, groups: &[&str]) -> String {
        let mut text = String::new();
        let counts = |p: &&Parameter| p.group != "resources" && groups.contains(&p.group) && p.applies(self);
        for parameter in parameters().iter().filter(counts) {
            text += &format!("{}={}\n", parameter.name, parameter.value(self));
        }
        text
    }
}

/// Whether a text is a day of the calendar, `YYYY-MM-DD`.
fn is_day(text: &str) -> bool {
    let parts: Vec<&str> = text.split('-').collect();
    let [year, month, day] = parts.as_slice() else { return false };
    let number = |part: &str, digits: usize| {
        let is_number = part.len() == digits && part.bytes().all(|b| b.is_ascii_digit());
        if is_number { part.parse::<u32>().ok() } else { None }
    };
    let (Some(year), Some(month), Some(day)) = (number(year, 4), number(month, 2), number(day, 2)) else {
        return false;
    };
    let is_leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
    let last = match month {
        2 if is_leap => 29,
        2 => 28,
        4 | 6 | 9 | 11 => 30,
        1..=12 => 31,
        _ => return false,
    };
    year > 0 && (1..=last).contains(&day)
}

/// The preset and the settings of a config file. Parameters stand in tables by group (`[sampling]`,
/// `step = 0.1`), or at the top by a unique short name.
fn read_config(text: &str) -> Result<(Option<String>, Vec<(String, String)>), ParamError> {
    let table: toml::Table =
        text.parse().map_err(|e: toml::de::Error| ParamError::Config(e.to_string().trim_end().to_owned()))?;
    let mut preset = None;
    let mut settings = Vec::new();
    for (key, value) in &table {
        match value {
            toml::Value::String(name) if key == "preset" => preset = Some(name.clone()),
            toml::Value::Table(group) if GROUPS.iter().any(|(name, _)| name == key) => {
                for (name, value) in group {
                    let name = format!("{key}.{name}");
                    settings.push((name.clone(), config_value(&name, value)?));
                }
            }
            toml::Value::Table(_) => {
                let suggestion = nearest(key, GROUPS.iter().map(|(name, _)| *name));
                return Err(ParamError::Unknown { name: format!("[{key}]"), suggestion });
            }
            _ => settings.push((key.clone(), config_value(key, value)?)),
        }
    }
    Ok((preset, settings))
}

/// A TOML value as the text that [`Params::set`] reads.
fn config_value(name: &str, value: &toml::Value) -> Result<String, ParamError> {
    match value {
        toml::Value::String(s) => Ok(s.clone()),
        toml::Value::Integer(i) => Ok(i.to_string()),
        toml::Value::Float(f) => Ok(f.to_string()),
        toml::Value::Boolean(b) => Ok(b.to_string()),
        toml::Value::Array(items) => {
            let items: Result<Vec<_>, _> = items.iter().map(|v| config_value(name, v)).collect();
            Ok(items?.join(","))
        }
        other => Err(ParamError::Value {
            name: name.to_owned(),
            value: other.to_string(),
            expected: "a number, a text, true or false, or a list".to_owned(),
        }),
    }
}

#[cfg(test)]
mod tests;
