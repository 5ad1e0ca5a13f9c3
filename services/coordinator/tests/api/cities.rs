//! What readers see: cities, generations, buildings, files.

use crate::{Answer, Service, start};
use gable_job_store::{Artifact, CityBuilding, Finished, Publication};
use serde_json::{Value, json};

/// A tile with a building for each number: a square of a metre at that many metres from the corner.
fn tile(corner: f64, numbers: &[i64]) -> String {
    let mut objects = json!({ "terrain": { "type": "TINRelief",
        "geometry": [{ "type": "CompositeSurface", "lod": "1", "boundaries": [[[0, 1, 2]]] }] } });
    let mut vertices: Vec<[i64; 3]> = Vec::new();
    for &n in numbers {
        let (x, first) = (n * 10_000, vertices.len());
        vertices.extend([[x, 0, 0], [x + 10_000, 0, 0], [x + 10_000, 10_000, 0], [x, 10_000, 0]]);
        let ring = [first, first + 3, first + 2, first + 1];
        objects[format!("b-{n}")] = json!({ "type": "Building", "geometry": [{ "type": "MultiSurface", "lod": "0",
            "boundaries": [[ring]], "semantics": { "surfaces": [{ "type": "GroundSurface" }], "values": [0] } }] });
    }
    json!({ "type": "CityJSON", "version": "2.0", "CityObjects": objects, "vertices": vertices,
        "transform": { "scale": [0.0001, 0.0001, 0.0001], "translate": [corner, 446_000.0, 0.0] },
        "metadata": { "referenceSystem": "https://www.opengis.net/def/crs/EPSG/0/7415" } })
    .to_string()
}

fn building(tile: &str, n: i64, hash: &str, height: f64) -> CityBuilding {
    let x = 85_000.0 + n as f64;
    CityBuilding {
        id: format!("b-{n}"),
        hash: hash.to_owned(),
        tile: tile.to_owned(),
        bbox: [x, 446_000.0, x + 1.0, 446_001.0],
        lod: "lod2".to_owned(),
        roof_type: Some("flat".to_owned()),
        height,
        area: 1.0,
        attributes: json!({ "eaves_m": 3.5 }).to_string(),
    }
}

/// Publishes a generation of a city with these files and buildings.
async fn publish(service: &Service, city: &str, files: &[(&str, String)], buildings: Vec<CityBuilding>) -> String {
    let made = service.submit(&json!({ "source": "mesh.obj", "city": city }), &[]).await;
    let mut artifacts = Vec::new();
    for (path, content) in files {
        let blob = service.parts.blobs.put(content.clone()).await.expect("put");
        artifacts.push(Artifact { path: format!("result/{path}"), blob, bytes: content.len() as u64 });
    }
    let publication = Some(Publication { crs: "EPSG:7415".to_owned(), buildings });
    service.finish_next(Finished { artifacts, publication, ..Finished::default() }).await;
    made.json()["id"].as_str().expect("an id").to_owned()
}

/// A service with a city of two generations: b-2 goes, b-3 changes, b-4 comes.
async fn city() -> Service {
    let service = start().await;
    let files = [("tiles/0_0.city.json", tile(85_000.0, &[1, 2])), ("tiles/1_0.city.json", tile(85_001.0, &[2]))];
    let first = vec![building("0_0", 1, "h", 5.0), building("0_0", 2, "h", 6.0), building("1_0", 3, "h", 7.0)];
    publish(&service, "del ft/1", &files, first).await;
    let files = [
        ("tiles/0_0.city.json", tile(85_000.0, &[1])),
        ("tiles/1_0.city.json", tile(85_001.0, &[3, 4])),
        ("tiles/1_0.gml", "<gml/>".to_owned()),
        ("index.json", "{}".to_owned()),
        ("3dtiles/tileset.json", "{\"asset\":{}}".to_owned()),
    ];
    let second = vec![building("0_0", 1, "h", 5.0), building("1_0", 3, "other", 7.5), building("1_0", 4, "h", 9.0)];
    publish(&service, "del ft/1", &files, second).await;
    service
}

const CITY: &str = "/api/v1/cities/del%20ft%2F1";

async fn get(service: &Service, path: &str) -> Answer {
    service.get(&format!("{CITY}{path}")).await
}

fn ids(collection: &Value) -> Vec<&str> {
    collection["features"].as_array().expect("features").iter().map(|f| f["id"].as_str().expect("an id")).collect()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn generations_are_shown_and_compared() {
    let service = city().await;
    publish(&service, "hague", &[], Vec::new()).await;
    let page = service.get("/api/v1/cities?limit=1").await.json();
    assert_eq!((&page["cities"][0]["name"], &page["next"]), (&json!("del ft/1"), &json!("del ft/1")));
    let page = service.get("/api/v1/cities?after=del%20ft%2F1").await.json();
    assert_eq!((&page["cities"][0]["name"], page.get("next")), (&json!("hague"), None));

    let shown = get(&service, "").await;
    assert_eq!((&shown.json()["generation"], &shown.json()["current"]["crs"]), (&json!(2), &json!("EPSG:7415")));
    let known = service.ask("GET", CITY, &[("if-none-match", shown.header("etag"))], None).await;
    assert_eq!(known.status, 304);
    let page = get(&service, "/generations?limit=1").await.json();
    let newest = &page["generations"][0];
    let counts =
        ["number", "buildings", "added", "removed", "changed"].map(|name| newest[name].as_i64().expect("a number"));
    assert_eq!((counts, &page["next"]), ([2, 3, 1, 1, 1], &json!(2)));
    assert_eq!(get(&service, "/generations/1").await.json()["buildings"], 3);
    get(&service, "/generations/3").await.problem(404, "not-found");
    get(&service, "/generations/last").await.problem(400, "path");

    let changes = get(&service, "/changes").await.json();
    let expected = json!([{ "id": "b-2", "change": "removed" }, { "id": "b-3", "change": "changed" }, { "id": "b-4", "change": "added" }]);
    assert_eq!(changes, json!({ "from": 1, "to": 2, "changes": expected }));
    let back = get(&service, "/changes?from=2&to=1&limit=1").await.json();
    assert_eq!((&back["changes"], &back["next"]), (&json!([{ "id": "b-2", "change": "added" }]), &json!("b-2")));
    assert_eq!(get(&service, "/changes?from=0&to=1").await.json()["changes"].as_array().map(Vec::len), Some(3));
    get(&service, "/changes?from=7").await.problem(404, "not-found");
    service.get("/api/v1/cities/none").await.problem(404, "not-found");
    service.get("/api/v1/cities/none/changes?from=0&to=0").await.problem(404, "not-found");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn buildings_are_found_by_place_and_attributes() {
    let service = city().await;
    let all = get(&service, "/buildings").await;
    assert_eq!(all.header("content-type"), "application/geo+json");
    let all = all.json();
    assert_eq!((ids(&all), all.get("links")), (vec!["b-1", "b-3", "b-4"], None));
    assert_eq!(all["crs"]["properties"]["name"], "urn:ogc:def:crs:EPSG::7415");
    let first = &all["features"][0];
    assert_eq!((&first["properties"]["eaves_m"], &first["properties"]["height_m"]), (&json!(3.5), &json!(5.0)));
    assert_eq!(first["bbox"], json!([85_001.0, 446_000.0, 85_002.0, 446_001.0]));
    let ring = &first["geometry"]["coordinates"][0][0];
    assert_eq!(ring.as_array().expect("a ring").len(), 5);
    assert_eq!(ring[0], ring[4]);

    let found = async |query: &str| ids(&get(&service, &format!("/buildings?{query}")).await.json()).join(" ");
    assert_eq!(found("bbox=85000,446000,85002.5,446001").await, "b-1");
    assert_eq!(found("min_height=6&max_height=8").await, "b-3");
    assert_eq!(found("roof_type=hipped").await, "");
    assert_eq!(found("generation=1").await, "b-1 b-2 b-3");
    for wrong in [
        "bbox=1,2,3",
        "bbox=3,0,1,0",
        "bbox=a,b,c,d",
        "min_height=high",
        "min_height=NaN",
        "colour=red",
        "limit=0",
        "f=dxf",
    ] {
        get(&service, &format!("/buildings?{wrong}")).await.problem(400, "query");
    }

    // Page by page, by the addresses that the service gives.
    let mut seen = Vec::new();
    let mut next = Some(format!("{CITY}/buildings?limit=2"));
    while let Some(address) = next {
        let page = service.get(&address).await;
        let link = page.headers.get("link").map(|l| l.to_str().expect("text").to_owned());
        let page = page.json();
        next = page["links"][0]["href"].as_str().map(str::to_owned);
        assert_eq!(link, next.as_ref().map(|n| format!("<{n}>; rel=\"next\"")));
        seen.extend(ids(&page).into_iter().map(str::to_owned));
    }
    assert_eq!(seen, ["b-1", "b-3", "b-4"]);

    let one = get(&service, "/buildings/b-3").await.json();
    assert_eq!((&one["id"], &one["properties"]["height_m"]), (&json!("b-3"), &json!(7.5)));
    assert_eq!(get(&service, "/buildings/b-3?generation=1").await.json()["properties"]["height_m"], 7.0);
    get(&service, "/buildings/b-2").await.problem(404, "not-found");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn buildings_come_with_all_geometries() {
    let service = city().await;
    let address = format!("{CITY}/buildings");
    let answer = service.ask("GET", &address, &[("accept", "application/city+json-seq")], None).await;
    assert_eq!(answer.header("content-type"), "application/city+json-seq");
    let text = String::from_utf8(answer.body).expect("text");
    let lines: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    assert_eq!((&lines[0]["type"], lines.len()), (&json!("CityJSON"), 4));
    assert_eq!(lines[0]["transform"]["translate"], json!([85_000.0, 446_000.0, 0.0]));
    // The other tile stands a metre to the east.
    assert_eq!((&lines[2]["id"], &lines[2]["vertices"][0]), (&json!("b-3"), &json!([40_000, 0, 0])));
    let one = get(&service, "/buildings/b-1?f=cityjsonseq").await;
    assert_eq!(String::from_utf8_lossy(&one.body).lines().count(), 2);
    assert!(get(&service, "/buildings?f=cityjsonseq&roof_type=none").await.body.is_empty());
    service.ask("GET", &address, &[("accept", "text/html")], None).await.problem(406, "form");
    publish(&service, "plain", &[], vec![building("0_0", 1, "h", 5.0)]).await;
    let plain = service.get("/api/v1/cities/plain/buildings").await.problem(409, "no-cityjson");
    assert!(plain.contains("output.formats"), "{plain}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn files_of_a_city_are_served() {
    let service = city().await;
    let tiles = get(&service, "/tiles").await.json();
    let names: Vec<_> =
        tiles["tiles"].as_array().expect("tiles").iter().map(|t| t["name"].as_str().expect("a name")).collect();
    assert_eq!((names, &tiles["generation"]), (vec!["0_0", "1_0"], &json!(2)));
    assert_eq!(tiles["tiles"][1]["files"]["gml"]["path"], "tiles/1_0.gml");
    assert_eq!(tiles["tiles"][1]["files"]["city.json"]["bytes"], tile(85_001.0, &[3, 4]).len());
    let files = get(&service, "/files?prefix=3dtiles/").await.json();
    assert_eq!(files["files"][0]["path"], "3dtiles/tileset.json");
    assert_eq!(get(&service, "/files?generation=1").await.json()["files"].as_array().map(Vec::len), Some(2));

    let file = get(&service, "/files/3dtiles/tileset.json").await;
    assert_eq!((&*file.body, file.header("content-type")), (&b"{\"asset\":{}}"[..], "application/json"));
    let address = format!("{CITY}/files/3dtiles/tileset.json");
    let known = service.ask("GET", &address, &[("if-none-match", file.header("etag"))], None).await;
    assert_eq!(known.status, 304);
    let part = service.ask("GET", &address, &[("range", "bytes=2-6")], None).await;
    assert_eq!((part.status, &*part.body), (206, &b"asset"[..]));
    let old = get(&service, "/files/tiles/0_0.city.json?generation=1").await;
    assert_eq!(old.body, tile(85_000.0, &[1, 2]).into_bytes());
    get(&service, "/files/index.json?generation=1").await.problem(404, "not-found");
    get(&service, "/files/..%2F..%2Fjobs.db").await.problem(404, "not-found");
    get(&service, "/files/%FF").await.problem(400, "path");
}
