"""Checks what is in deploy/ as far as it can be without a container engine and a cluster.

Dockerfile: hadolint. Compose: the schema of the Compose specification. Helm chart: Helm's own lint, its templates rendered with several
sets of values, and every manifest against the strict schemas of Kubernetes (of KEDA's kinds there are none here). systemd: its own
verification and rating. Grafana: the board's form. Prometheus: the rules' form. That the metrics of both are those of the service, a test of
the service checks, on what it tells.
"""

import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
DEPLOY = ROOT / "deploy"
TOOLS = pathlib.Path(sys.executable).parent
failures = []


def check(what, right, why=""):
    print(("ok      " if right else "WRONG   ") + what + ("" if right else f": {why}"))
    if not right:
        failures.append(what)


def run(what, *command):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    check(what, done.returncode == 0, done.stdout + done.stderr)


def helm():
    import helm_python
    import kubernetes_validate
    import yaml

    chart = DEPLOY / "helm" / "gable"
    report = helm_python.lint(str(chart), strict=True)
    check("helm lint", not [m for m in report["messages"] if m["severity"] >= 2] and not report["errors"], report)
    sets = {
        "defaults": {},
        "no scaling": {"scaling": {"kind": "none", "replicas": 3}, "coordinator": {"replicas": 1}},
        "volume": {
            "meshes": {"existingClaim": "meshes"},
            "sourceRoots": ["/meshes"],
            "store": {"place": "s3://city", "endpoint": "http://objects:9000"},
            "traces": {"endpoint": "http://collector:4318"},
            "imagePullSecrets": [{"name": "registry"}],
            "worker": {"nodeSelector": {"disk": "ssd"}, "tolerations": [{"key": "batch", "operator": "Exists"}]},
        },
    }
    for name, values in sets.items():
        loaded = helm_python.Chart.load(str(chart))
        kinds, traced = [], 0
        for path, text in loaded.render(values, name="city", namespace="gable").items():
            for manifest in filter(None, yaml.safe_load_all(text)):
                kinds.append(manifest["kind"])
                traced += "OTEL_EXPORTER_OTLP_ENDPOINT" in json.dumps(manifest)
                if manifest["apiVersion"].startswith("keda.sh/"):
                    continue
                try:
                    kubernetes_validate.validate(manifest, "1.30", strict=True)
                except Exception as error:  # whatever it finds, it is this manifest's
                    check(f"helm template, {name}, {path}", False, error)
        scaled = "ScaledObject" in kinds
        check(f"helm template, {name}: {traced} send traces", traced == (2 if "traces" in values else 0))
        check(f"helm template, {name}: {', '.join(sorted(kinds))}", scaled == (name != "no scaling") and len(kinds) >= 3)
    for wrong in ({"store": {"place": "/folder"}}, {"scaling": {"kind": "magic"}}, {"sourceRoots": []}, {"traces": {"endpoint": "collector:4318"}}):
        try:
            helm_python.Chart.load(str(chart)).validate_schema(wrong)
            check(f"values {wrong} are refused", False, "they are not")
        except Exception as error:
            check(f"values {wrong} are refused", "at '/" in str(error), error)


def systemd():
    if not shutil.which("systemd-analyze"):
        print("skipped systemd units: systemd-analyze is not installed")
        return
    with tempfile.TemporaryDirectory() as folder:
        for unit in sorted((DEPLOY / "systemd").glob("*.service")):
            # The program need not be installed where this runs.
            copy = pathlib.Path(folder) / unit.name
            copy.write_text(unit.read_text().replace("/usr/bin/gable", "/bin/true"))
            run(f"systemd-analyze verify {unit.name}", "systemd-analyze", "verify", "--man=no", copy)
            # A restart leaves tasks the time that the program gives them, and does not end them behind its back.
            text = unit.read_text()
            patience = int(re.search(r"^TimeoutStopSec=(\d+)$", text, re.M).group(1))
            check(f"{unit.name}: tasks end by their worker", re.search(r"^KillMode=mixed$", text, re.M) and patience >= 75, patience)
            run(f"systemd-analyze security {unit.name}", "systemd-analyze", "security", "--offline=true", "--threshold=20", copy)


def grafana():
    board = json.loads((DEPLOY / "grafana" / "gable.json").read_text())
    panels = board["panels"]
    check("board: ids", len({p["id"] for p in panels}) == len(panels))
    cells = [
        (x, y) for p in panels for g in [p["gridPos"]] for x in range(g["x"], g["x"] + g["w"]) for y in range(g["y"], g["y"] + g["h"])
    ]
    check("board: panels lie side by side", len(set(cells)) == len(cells) and max(x for x, _ in cells) < 24)


def rules():
    import yaml

    groups = yaml.safe_load((DEPLOY / "prometheus" / "gable.rules.yaml").read_text())["groups"]
    alerts = [rule for group in groups for rule in group["rules"]]
    names = [rule["alert"] for rule in alerts]
    check(f"rules: {len(names)} alerts, each of a name of its own", names and len(set(names)) == len(names), names)
    for rule in alerts:
        right = set(rule) <= {"alert", "expr", "for", "labels", "annotations"} and set(rule["annotations"]) == {"summary", "what_to_do"}
        balanced = all(rule["expr"].count(a) == rule["expr"].count(b) for a, b in ("()", "[]", "{}"))
        spans = re.findall(r"\[([^]]*)\]", rule["expr"]) + [rule.get("for", "1m")]
        right = right and balanced and all(re.fullmatch(r"\d+[smhd]", span) for span in spans)
        check(f"rules: {rule['alert']}", right and rule["labels"]["severity"] in ("page", "ticket"), rule)


run("hadolint", TOOLS / "hadolint", "--failure-threshold", "info", DEPLOY / "Dockerfile")
compose = DEPLOY / "compose" / "compose.yaml"
run("compose specification", TOOLS / "check-jsonschema", "--builtin-schema", "vendor.compose-spec", compose)
helm()
systemd()
grafana()
rules()
print(f"{len(failures)} wrong")
sys.exit(1 if failures else 0)
