use super::*;

fn settings(list: &[(&str, &str)]) -> Vec<(String, String)> {
    list.iter().map(|(n, v)| ((*n).to_owned(), (*v).to_owned())).collect()
}

fn value(params: &Params, name: &str) -> String {
    parameters().iter().find(|p| p.name == name).unwrap().value(params)
}

#[test]
fn every_default_is_in_range_and_reads_back() {
    let defaults = Params::default();
    defaults.check().unwrap();
    let mut copy = Params::default();
    for p in parameters().iter().filter(|p| p.applies(&defaults)) {
        assert!(!p.help.trim().is_empty() && !p.help.contains('\n'), "{} needs one line of help", p.name);
        assert_eq!(
            p.bounds.is_some(),
            matches!(p.kind, "number" | "integer"),
            "{}: numbers and only numbers have limits",
            p.name
        );
        copy.set(&p.name, &p.value(&defaults)).unwrap();
    }
    assert!(parameters().iter().all(|p| p.value(&copy) == p.value(&defaults)));
    copy.check().unwrap();
}

#[test]
fn names_are_unique() {
    let mut names: Vec<_> = parameters().iter().map(|p| p.name.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), parameters().len());
}

#[test]
fn presets_hold() {
    for preset in PRESETS {
        let params = Params::assemble(Some(preset.name), None, &[]).unwrap();
        for (name, value) in preset.values {
            let p = parameters().iter().find(|p| p.name == *name).unwrap();
            assert_eq!(p.value(&params), *value, "{}: {name}", preset.name);
        }
    }
    let published = Params::assemble(Some("zhu2018"), None, &[]).unwrap();
    assert_eq!((&*published.segmentation.method, &*published.modeling.method), ("zhu2018", "zhu2018"));
}

#[test]
fn later_layers_win() {
    let config = "preset = 'fast'\nmu = 2.5\n[sampling]\nstep = 0.5\n[output]\nformats = ['citygml', 'cityjson']\n";
    let params = Params::assemble(None, Some(config), &settings(&[("sampling.step", "0.25")])).unwrap();
    assert_eq!(
        (params.sampling.step, value(&params, "segmentation.mu"), params.segmentation.patch),
        (0.25, "2.5".to_owned(), 256)
    );
    assert_eq!(params.output.formats, [Format::CityJson, Format::CityGml]);
    // A preset of the command line replaces the config's, and the config's values still hold.
    let params = Params::assemble(Some("fine"), Some(config), &[]).unwrap();
    assert_eq!((params.sampling.step, params.segmentation.patch), (0.5, 1024));
}

#[test]
fn method_alone_sets_every_stage() {
    let params = Params::assemble(None, None, &settings(&[("method", "zhu2018")])).unwrap();
    assert_eq!((&*params.segmentation.method, &*params.modeling.method), ("zhu2018", "zhu2018"));
    // A method that one stage alone has, and the name that the defaults once had.
    let params = Params::assemble(None, None, &settings(&[("method", "planes-first")])).unwrap();
    assert_eq!((&*params.segmentation.method, &*params.modeling.method), ("likelihood", "planes-first"));
    let former = Params::assemble(None, None, &settings(&[("method", "gable")])).unwrap();
    assert_eq!(former, Params::default());
    let unknown = Params::assemble(None, None, &settings(&[("method", "zhu2019")])).unwrap_err().to_string();
    assert!(unknown.contains("one of"), "{unknown}");
}

#[test]
fn messages_say_what_to_do() {
    let message = |config: Option<&str>, list: &[(&str, &str)]| {
        Params::assemble(None, config, &settings(list)).unwrap_err().to_string()
    };
    assert_eq!(
        message(None, &[("samplng.step", "1")]),
        "there is no parameter \"samplng.step\" (did you mean \"sampling.step\"?); `gable params` lists all"
    );
    assert_eq!(message(None, &[("step", "9")]), "sampling.step = 9 is out of range: give 0.02 to 5 m");
    assert_eq!(message(None, &[("step", "NaN")]), "sampling.step = \"NaN\" cannot be read: give a number such as 0.25");
    assert_eq!(message(None, &[("up", "x")]), "input.up = \"x\" cannot be read: give one of auto, z, y, -z, -y");
    assert_eq!(
        message(None, &[("terrain", "true")]),
        "the name \"terrain\" is short for segmentation.terrain and output.terrain: write one of them in full"
    );
    assert!(message(None, &[("crs", "EPSG:12")]).contains("give EPSG:7415"));
    assert!(message(None, &[("block-size", "1")]).contains("less than ten pixels"));
    assert!(message(None, &[("margin", "500")]).contains("more than half"));
    assert!(message(Some("[sampling]\nstep = = 2"), &[]).contains("line 2"));
    assert!(message(Some("[smapling]\nstep = 2"), &[]).contains("did you mean \"sampling\"?"));
    assert!(message(Some("preset = 'fin'"), &[]).contains("did you mean \"fine\"?"));
    assert!(message(Some("[output]\nformats = []"), &[]).contains("at least one of cityjson"));
}

#[test]
fn the_hash_input_leaves_out_resources() {
    let mut a = Params::default();
    let groups: Vec<_> = GROUPS.iter().map(|(name, _)| *name).collect();
    let before = a.canonical(&groups);
    a.set("threads", "7").unwrap();
    assert_eq!(a.canonical(&groups), before);
    a.set("step", "0.21").unwrap();
    assert_ne!(a.canonical(&groups), before);
    assert_eq!(a.canonical(&["sampling"]), "sampling.step=0.21\n");
}

#[test]
fn a_parameter_of_another_method_is_refused_and_says_whose_it_is() {
    let other = settings(&[("modeling.beta_pixel", "20")]);
    let error = Params::assemble(None, None, &other).unwrap_err().to_string();
    assert_eq!(
        error,
        "modeling.beta_pixel belongs to the method zhu2018: the method of modeling is planes-first, which has no such parameter"
    );
    // Whichever is said first.
    let both = settings(&[("modeling.beta_pixel", "20"), ("modeling.method", "zhu2018")]);
    let params = Params::assemble(None, None, &both).unwrap();
    assert_eq!(value(&params, "modeling.beta_pixel"), "20");
    // What a preset wants holds where it can.
    let params = Params::assemble(Some("fast"), None, &settings(&[("modeling.method", "zhu2018")])).unwrap();
    assert_eq!(value(&params, "modeling.plane_area"), "6");
}

#[test]
fn methods_bring_their_defaults() {
    let published = Params::assemble(Some("zhu2018"), None, &[]).unwrap();
    assert_eq!(["segmentation.mu", "segmentation.h_trunc"].map(|name| value(&published, name)), ["1", "3"]);
    assert_eq!(["segmentation.mu", "segmentation.h_trunc"].map(|name| value(&Params::default(), name)), ["2", "2"]);
    let text = published.canonical(&["segmentation"]);
    assert!(text.contains("segmentation.mu=1\n") && !text.contains("tree_weight"), "{text}");
}

#[test]
fn what_a_data_set_tells_of_itself_is_checked() {
    let checked = |settings: &[(&str, &str)]| {
        let settings: Vec<_> = settings.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect();
        Params::assemble(None, None, &settings).and_then(|params| params.check()).map_err(|e| e.to_string())
    };
    for day in ["2024-02-29", "1999-12-31"] {
        assert_eq!(checked(&[("output.reference_date", day)]), Ok(()));
    }
    for day in ["2023-02-29", "2025-13-01", "2025-4-30", "30.4.2025", "2025-04-31", "0000-01-01", "2025-04-+1"] {
        assert!(checked(&[("output.reference_date", day)]).unwrap_err().contains("2025-06-30"), "{day}");
    }
    let contact = [("output.contact_name", "City of Delft")];
    assert!(checked(&contact).unwrap_err().contains("contact_email"));
    assert_eq!(checked(&[contact[0], ("output.contact_email", "geo@delft.example")]), Ok(()));
    assert!(checked(&[("output.lineage", "a\nb")]).unwrap_err().contains("one line"));
}
