//! No file makes measuring panic, hang or fill the memory.

mod made;
#[path = "../../city-model/tests/common/mutants.rs"]
mod mutants;

use gable_city_model::{CityModel, ReadOptions, read_cityjson_str, write_cityjson};
use gable_evaluation::{Error, Inputs, Options, evaluate, html_report, inspect};
use gable_geometry::{DVec3, dvec3};
use made::{building, city, gable, ground, house, moved};
use mutants::mutant;
use std::path::Path;

const MUTANTS: u64 = 1500;

fn village() -> CityModel {
    let mut model = city(vec![
        building("gable", gable()),
        house("left", 20., 0., 10., 10., 6.),
        house("shed", 60., 0., 2., 2., 2.5),
    ]);
    model.terrain = Some(ground(1.0));
    model
}

fn read(text: &str) -> Option<CityModel> {
    read_cityjson_str(text, Path::new("mutant"), &ReadOptions::default()).ok().map(|reading| reading.model)
}

#[test]
fn mutants_are_measured_or_refused() {
    // Coarse, so that there is time for many.
    let (truth, options) = (village(), Options { roof_step: 2.0, density: 0.01, seed: 1 });
    let mut out = Vec::new();
    write_cityjson(&truth, &mut out).unwrap();
    let text = String::from_utf8(out).unwrap();
    let mesh = || Box::new([[dvec3(0., 0., 6.), dvec3(9., 0., 6.), dvec3(0., 9., 6.)]; 3].into_iter());
    let (mut measured, mut refused) = (0, 0);
    for number in 0..MUTANTS {
        let Some(result) = read(&mutant(&text, number)) else { continue };
        for (truth, result) in [(&truth, &result), (&result, &truth)] {
            let inputs = Inputs { mesh: Some(mesh()), again: Some(result), ..Inputs::new(truth, result) };
            match evaluate(inputs, &options) {
                Ok(evaluation) => {
                    measured += 1;
                    html_report(truth, result, &evaluation, &options).unwrap();
                }
                Err(Error::NoCity { .. }) => refused += 1,
                Err(other) => panic!("{other}"),
            }
        }
        let _ = inspect(&result, Some(mesh()), &options);
    }
    assert!(measured > 100 && refused > 10, "{measured} measured, {refused} refused");
}

#[test]
fn models_that_no_city_has_are_refused() {
    let options = Options::default();
    let refused = |model: &CityModel| {
        let error = evaluate(Inputs::new(&village(), model), &options).unwrap_err().to_string();
        assert_eq!(inspect(model, None, &options).unwrap_err().to_string(), error);
        error
    };
    let mut wide = village();
    wide.buildings[1].lods.lod2[0].vertices[0].x = 1e7;
    assert!(refused(&wide).contains("building \"left\" measures"), "{}", refused(&wide));
    let mut flat = village();
    flat.terrain.as_mut().unwrap().vertices[0].y = 1e7;
    assert!(refused(&flat).contains("the terrain measures"), "{}", refused(&flat));
    let towers = city((0..60).map(|i| house(&format!("{i}"), 0., 0., 1000., 1000., 1000. + f64::from(i))).collect());
    assert!(refused(&towers).contains("km² of surface"), "{}", refused(&towers));
    let heap = city((0..11_000).map(|i| house(&format!("{i}"), 0., 0., 1., 1., 1.)).collect());
    assert!(refused(&heap).contains("one upon the other"), "{}", refused(&heap));

    // The truth is measured far from the result, but not with a mesh, which would need a map of all between.
    let far = moved(&village(), dvec3(5e6, 5e6, 0.0));
    let (village, triangle) = (village(), [DVec3::ZERO, dvec3(1., 0., 0.), dvec3(0., 1., 0.)]);
    assert!(evaluate(Inputs::new(&village, &far), &options).is_ok());
    let with = |triangle: [DVec3; 3], result: &CityModel| {
        let inputs = Inputs { mesh: Some(Box::new([triangle].into_iter())), ..Inputs::new(&village, result) };
        evaluate(inputs, &options).map(drop).map_err(|e| e.to_string())
    };
    assert!(with(triangle, &far).is_err_and(|e| e.contains("apart")));
    assert!(with(triangle.map(|p| p * 1e6), &village).is_err_and(|e| e.contains("a triangle of the mesh")));
    assert!(with(triangle, &village).is_ok());
}
