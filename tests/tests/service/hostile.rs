//! What users send is read inside of itself only, costs no more than a city, and reaches no secret of the service.

use gable_tests::{Database, Service, town};
use serde_json::{Value, json};
use std::io::Write as _;
use std::path::Path;
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(120);

/// What stands in a file of the machine that is no source, again and again.
const SECRET: &str = "hunter2-";

/// A glTF of a triangle whose numbers lie in a file that its URI names.
fn gltf(uri: &str) -> Vec<u8> {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],"buffers":[{{"uri":"{uri}","byteLength":36}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}}],"accessors":[{{"bufferView":0,"componentType":5126,"count":3,
        "type":"VEC3","min":[0,0,0],"max":[1,1,1]}}]}}"#
    )
    .into_bytes()
}

fn zip(files: &[(&str, &[u8])]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, content) in files {
        let options = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Deflated);
        zip.start_file(*name, options).unwrap();
        zip.write_all(content).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

/// Sends files as an upload, and gives all that the service tells of the job that reads them.
fn told(service: &Service, city: &str, files: &[(&str, &[u8])]) -> (String, String) {
    let upload = service.send(&format!("/uploads?name={city}.zip"), &zip(files));
    let job = service.submit(
        Path::new(upload["source"].as_str().unwrap()),
        city,
        &json!({ "grid.columns": 1, "grid.rows": 1 }),
    );
    let state = service.wait(&job, LIMIT);
    let mut told = service.get(&format!("/jobs/{job}")).to_string();
    told += &service.get(&format!("/jobs/{job}/events?limit=1000")).to_string();
    told += &service.text(&format!("/api/v1/jobs/{job}/blocks/scene/log"));
    (state, told)
}

#[test]
fn a_mesh_that_is_sent_reads_no_file_of_the_machine() {
    let root = tempfile::tempdir().unwrap();
    let secret = root.path().join("secret");
    std::fs::write(&secret, SECRET.repeat(100)).unwrap();
    std::fs::create_dir(root.path().join("meshes")).unwrap();
    let Some(mut service) = Service::new("hostile", Database::Sqlite, &root.path().join("meshes"), 5.0) else { return };
    let _process = service.serve(&["--all", "--slots", "2"]);
    let up = "../".repeat(30) + secret.to_str().unwrap().trim_start_matches('/');
    for uri in [secret.to_str().unwrap(), &up, "/etc/passwd", "../../../../jobs.db", "/proc/self/environ", "/dev/zero"]
    {
        let (state, told) = told(&service, "gltf", &[("mesh.gltf", &gltf(uri))]);
        assert_eq!(state, "failed", "{told}");
        assert!(told.contains("lies outside of what may be read here"), "{uri}: {told}");
        assert!(!told.contains("hunter2") && !told.contains("root:"), "{uri}: {told}");
    }
    // The same by libraries and textures: what cannot be read is left out.
    let mesh = town(2, 0.004).join("mesh");
    let (name, obj) = gable_tests::files_of(&mesh).into_iter().find(|(name, _)| name.ends_with(".obj")).unwrap();
    let mut text = String::from_utf8(obj).unwrap();
    text = format!("mtllib {0} {up} /dev/zero /etc/passwd\n{text}", secret.display());
    let library = format!("newmtl a\nmap_Kd {}\nnewmtl b\nmap_Kd {up}\n", secret.display());
    let name = name.rsplit('/').next().unwrap();
    let (_, told) = told(&service, "obj", &[(name, text.as_bytes()), ("sent.mtl", library.as_bytes())]);
    assert!(!told.contains("hunter2") && !told.contains("root:"), "{told}");
}

#[test]
fn parameters_name_sources_only() {
    let mesh = town(2, 0.004).join("mesh");
    let Some(mut service) = Service::new("hostile-parameters", Database::Sqlite, &mesh, 5.0) else { return };
    let _process = service.serve(&[]);
    let data = Path::new(service.database().trim_start_matches("sqlite:")).to_owned();
    let agent: ureq::Agent = ureq::Agent::config_builder().http_status_as_error(false).build().into();
    for name in ["segmentation.weights", "segmentation.footprints", "segmentation.labels", "modeling.roofs"] {
        for file in
            ["/etc/hostname", "../../../../../../etc/hostname", data.to_str().unwrap(), "/dev/zero", "/none-such"]
        {
            let body = json!({ "source": mesh, "city": "delft", "parameters": { name: file } });
            let url = format!("{}/api/v1/jobs", service.address());
            let request = agent.post(&url).header("authorization", format!("Bearer {}", service.operator()));
            let mut answer = request.send_json(&body).unwrap();
            assert_eq!(answer.status().as_u16(), 422, "{name} {file}");
            let told: Value = answer.body_mut().read_json().unwrap();
            let detail = told["detail"].as_str().unwrap();
            assert!(detail.starts_with(name) && detail.contains("under a source root"), "{detail}");
        }
    }
}

/// A mesh whose twenty thousand triangles are shown so often that they would be sixty thousand million.
fn endless() -> Vec<u8> {
    let list = |count: usize, item: &str| vec![item; count].join(",");
    let roots = (0..3000).map(|i| i.to_string()).collect::<Vec<_>>().join(",");
    let (nodes, primitives) = (list(3000, r#"{"mesh":0}"#), list(1000, r#"{"attributes":{"POSITION":0},"indices":1}"#));
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[{roots}]}}],"nodes":[{nodes}],
        "meshes":[{{"primitives":[{primitives}]}}],"buffers":[{{"uri":"numbers.bin","byteLength":60036}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}},{{"buffer":0,"byteOffset":36,"byteLength":60000}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,1]}},
        {{"bufferView":1,"componentType":5121,"count":60000,"type":"SCALAR"}}]}}"#
    )
    .into_bytes()
}

#[test]
fn small_meshes_cost_no_more_than_a_city() {
    let root = tempfile::tempdir().unwrap();
    let Some(mut service) = Service::new("hostile-budgets", Database::Sqlite, root.path(), 5.0) else { return };
    let _process = service.serve(&["--all", "--slots", "1"]);
    let numbers = vec![0; 60_036];
    let (state, told) = told(&service, "endless", &[("mesh.gltf", &endless()), ("numbers.bin", &numbers)]);
    assert_eq!(state, "failed");
    assert!(told.contains("triangles from 60036 bytes"), "{told}");
    // Two squares at the ends of a country.
    let far = "v 0 0 0\nv 20 0 0\nv 20 20 0\nv 0 20 0\nv 200000 200000 0\nv 200020 200000 0\nv 200020 200020 0\nv 200000 200020 0\n\
               f 1 2 3 4\nf 5 6 7 8\n";
    let (state, told) = self::told(&service, "far", &[("mesh.obj", far.as_bytes())]);
    assert_eq!(state, "failed");
    assert!(told.contains("leave out what lies far off"), "{told}");
}

#[test]
fn tasks_see_no_secret_of_the_service() {
    let mesh = town(2, 0.004).join("mesh");
    let Some(mut service) = Service::new("hostile-secrets", Database::Sqlite, &mesh, 5.0) else { return };
    let folder = tempfile::tempdir().unwrap();
    let (script, seen) = (folder.path().join("wrap"), folder.path().join("seen"));
    std::fs::write(&script, format!("#!/bin/sh\nenv >> {}\nexec \"$@\"\n", seen.display())).unwrap();
    std::fs::set_permissions(&script, std::os::unix::fs::PermissionsExt::from_mode(0o755)).unwrap();
    for name in ["GABLE_TOKEN", "AWS_SECRET_ACCESS_KEY", "OTEL_EXPORTER_OTLP_HEADERS", "PGPASSWORD", "WHATEVER"] {
        service.set(name, SECRET);
    }
    let _process = service.serve(&["--all", "--slots", "1", "--task-wrapper", script.to_str().unwrap()]);
    let job = service.submit(&mesh, "delft", &json!({ "sampling.step": 0.5, "grid.columns": 1, "grid.rows": 1 }));
    service.expect(&job, "successful", LIMIT);
    let seen = std::fs::read_to_string(&seen).unwrap();
    assert!(seen.contains("PATH="), "{seen}");
    assert!(!seen.contains(SECRET) && !seen.contains("GABLE_"), "{seen}");
}
