"""OWSLib as a client of OGC API - Processes, against the service whose address is given, with the token and for the mesh that are given."""

import sys
import time

import requests
from openapi_spec_validator import validate
from owslib.ogcapi.processes import Processes

base, token, mesh = sys.argv[1:]
shown = {"Authorization": f"Bearer {token}"}
service = Processes(f"{base}/ogc/", headers=shown)

assert {link["rel"] for link in service.links} >= {"self", "conformance", "service-desc"}, service.links
classes = {name.rsplit("/", 1)[1] for name in service.conformance()["conformsTo"]}
assert classes >= {"core", "ogc-process-description", "json", "oas30", "job-list", "dismiss", "callback"}, classes
assert [process["id"] for process in service.processes()] == ["city-model", "echo"]

echoed = service.execute("echo", {"text": "a", "number": 1.5, "object": {"value": {"b": [1]}}})
assert echoed == {"text": "a", "number": 1.5, "object": {"b": [1]}}, echoed

described = service.process("city-model")
assert {"source", "city"} <= set(described["inputs"]), described
parameters = {"sampling.step": 0.5, "grid.columns": 2, "grid.rows": 2, "output.report": False}
inputs = {"source": mesh, "city": "ogc", "parameters": {"value": parameters}}
job = service.execute("city-model", inputs, async_=True)
job = job if isinstance(job, dict) else requests.get(job, timeout=10, headers=shown).json()
address = f"{base}/ogc/jobs/{job['jobID']}"
end = time.monotonic() + 120
while job["status"] in ("accepted", "running"):
    assert time.monotonic() < end, job
    time.sleep(0.3)
    job = requests.get(address, timeout=10, headers=shown).json()
assert job["status"] == "successful" and job["progress"] == 100, job
outputs = requests.get(f"{address}/results", timeout=10, headers=shown).json()
city = requests.get(outputs["city"]["href"], timeout=10, headers=shown)
assert city.status_code == 200 and b"CityJSONFeature" in city.content
listed = requests.get(f"{base}/ogc/jobs", params={"status": "successful"}, timeout=10, headers=shown).json()["jobs"]
assert job["jobID"] in [found["jobID"] for found in listed]

validate(requests.get(f"{base}/ogc/api", timeout=10, headers=shown).json())
print("OWSLib: landing page, conformance, processes, echo, a job from submission to results")
