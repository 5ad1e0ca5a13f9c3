"""Finds files of one crate that use each other in a circle.

Files in a circle can only be understood, tested and moved together. A file uses another if it names something of it, by `use` or by a
path that begins with `crate`, `super`, `self` or a module's name; a name that a module only passes on (`pub use`) counts as the file's in
which it stands. What tests use does not count, and neither does what comments say.

    tests/file_circles.py           fails if there is a circle that is not part of one in KNOWN, or if one in KNOWN is gone
    tests/file_circles.py --list    prints all circles, with the uses that make them
"""

import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent

# Circles that are still there: their files in the crate's src. This list gets shorter, never longer.
KNOWN = {
    "crates/city-model": [
        """
            validate/mod.rs validate/polygon.rs validate/ring.rs validate/snap.rs
        """,
    ],
    "crates/evaluation": [
        """
            budget.rs city.rs
        """,
        """
            evaluation.rs inspection.rs table.rs
        """,
        """
            real/judged_labels.rs real/judged_objects.rs real/scene.rs
        """,
    ],
    "crates/gis-formats": [
        """
            geotiff/mod.rs geotiff/pixels.rs geotiff/pyramid.rs geotiff/spool.rs
        """,
    ],
    "crates/job-store": [
        """
            database.rs events.rs jobs.rs members.rs tasks.rs webhooks.rs
        """,
        """
            claims.rs nodes.rs
        """,
        """
            parts.rs uploads.rs
        """,
    ],
    "crates/modeling": [
        """
            joining.rs party_walls.rs
        """,
    ],
    "crates/pipeline": [
        """
            params/mod.rs params/parameter.rs
        """,
        """
            stages/model.rs stages/vectors.rs summary.rs warnings.rs
        """,
        """
            report/html.rs report/mod.rs report/pictures.rs report/svg.rs
        """,
        """
            stages/ground_overview.rs stages/tiles3d.rs
        """,
        """
            units/map.rs units/mod.rs units/model.rs units/publish.rs units/sample.rs units/segment.rs units/split.rs
            units/stitch.rs units/terrain.rs units/write.rs
        """,
    ],
    "crates/reference-systems": [
        """
            identify.rs read.rs
        """,
    ],
    "crates/scene": [
        """
            b3dm.rs glb.rs
        """,
        """
            folder.rs gltf.rs jpeg2000.rs library.rs mtl.rs obj.rs obj_chunk.rs off.rs ply.rs scene.rs sink.rs texture.rs
        """,
    ],
    "crates/synthetic-city": [
        """
            scene.rs scene/builder.rs scene/closed.rs scene/fabric/sheets.rs scene/fabric/tarpaulins.rs scene/gardens.rs
            scene/layout.rs scene/place.rs scene/place/campus.rs scene/place/farm.rs scene/place/high_rise.rs
            scene/place/industry.rs scene/place/village.rs scene/quarters.rs scene/site.rs sensing/faults.rs sensing/faults/fill.rs
            sensing/faults/holes.rs sensing/faults/pits.rs sensing/faults/rim.rs
        """,
    ],
    "services/coordinator": [
        """
            access.rs api/blocks.rs api/failures.rs api/jobs.rs api/uploads.rs audit.rs auth.rs extract.rs receiving.rs rights.rs
            state.rs unpack/entry.rs unpack/mod.rs unpack/sevenz.rs unpack/tar.rs unpack/zip.rs visitor.rs
        """,
        """
            ogc/execution.rs ogc/jobs.rs ogc/mod.rs ogc/processes.rs
        """,
    ],
    "services/gable": [
        """
            exit.rs otlp.rs otlp_client.rs remote.rs terminal.rs
        """,
        """
            commands/bench/mod.rs commands/bench/places/mod.rs commands/bench/places/record.rs commands/bench/places/table.rs
            commands/bench/places/truth.rs commands/bench/real/mod.rs commands/bench/real/record.rs commands/bench/real/table.rs
            commands/bench/record.rs commands/bench/steps.rs commands/bench/table.rs commands/demo.rs commands/eval.rs
            commands/mod.rs commands/params.rs commands/run.rs commands/task.rs commands/thinned.rs commands/train.rs
        """,
    ],
    "services/worker": [
        """
            task.rs worker.rs
        """,
    ],
}


def without_comments_and_strings(text):
    pattern = r'//[^\n]*|/\*.*?\*/|r(#+)".*?"\1|"(?:\\.|[^"\\])*"|\'(?:\\.[^\']*|[^\'\\])\''
    return re.sub(pattern, " ", text, flags=re.S)


def end_of_block(text, start):
    """The place after the brace that closes the first one from `start` on."""
    depth = 0
    for at in range(text.index("{", start), len(text)):
        depth += {"{": 1, "}": -1}.get(text[at], 0)
        if depth == 0:
            return at + 1
    return len(text)


def without_tests(text):
    """The text without items for tests alone, and the modules that are files for tests alone."""
    test_files = re.findall(r"#\[cfg\(test\)\]\s*(?:pub(?:\([^)]*\))? )?mod (\w+);", text)
    while found := re.search(r"#\[cfg\(test\)\]\s*(?:#\[[^\]]*\]\s*)*(?:pub(?:\([^)]*\))? )?(?:mod|fn|impl|struct|use)\b[^;{]*([;{])", text):
        end = found.end() if found[1] == ";" else end_of_block(text, found.start())
        text = text[: found.start()] + text[end:]
    return text, test_files


def tree(text):
    """All paths of a tree such as a::{b, c::{self, d as e}}, as (path, name under which it is known)."""
    text = text.strip()
    if text.endswith("}"):
        prefix, inner = text[: text.index("{")], text[text.index("{") + 1 : -1]
        parts, depth, last = [], 0, 0
        for at, letter in enumerate(inner + ","):
            depth += {"{": 1, "}": -1}.get(letter, 0)
            if letter == "," and depth == 0:
                parts.append(inner[last:at])
                last = at + 1
        return [(prefix + path, name) for part in parts if part.strip() for path, name in tree(part)]
    path, _, name = (part.strip() for part in text.partition(" as "))
    return [(path, name or path.split("::")[-1])]


def with_inner_modules(text):
    """The text in which `super` of a module inside a file, which is that file, is called `self`."""
    for found in list(re.finditer(r"\bmod \w+\s*{", text)):
        end = end_of_block(text, found.start())
        # The letters stay where they are.
        inner = re.sub(r"\bsuper::", "self ::", text[found.end() : end])
        text = text[: found.end()] + inner + text[end:]
    return text


class Crate:
    def __init__(self, folder):
        source = folder / "src"
        # By module path, as a tuple of names.
        self.files, self.texts, self.passed_on = {}, {}, {}
        for path in sorted(source.rglob("*.rs")):
            parts = list(path.relative_to(source).with_suffix("").parts)
            if parts[-1] in ("lib", "main") and len(parts) == 1 or parts[-1] == "mod":
                parts.pop()
            if tuple(parts) not in self.files or path.name == "lib.rs":
                self.files[tuple(parts)] = path.relative_to(folder).as_posix()
                self.texts[tuple(parts)] = without_comments_and_strings(path.read_text())
        for module in sorted(self.texts):
            if module in self.texts:
                text, tests = without_tests(self.texts[module])
                self.texts[module] = with_inner_modules(text)
                for name in tests:
                    gone = (*module, name)
                    for other in [other for other in self.texts if other[: len(gone)] == gone]:
                        del self.texts[other]
        for module, text in self.texts.items():
            names = {}
            for found in re.finditer(r"\bpub(?:\([^)]*\))?\s+use\s+([^;]+);", text):
                names.update({name: path for path, name in tree(found[1])})
            self.passed_on[module] = names

    def absolute(self, module, path):
        """The path from the crate's root, or None for another crate's."""
        parts = path.replace(" ", "").replace("\n", "").split("::")
        if parts[0] == "crate":
            return parts[1:]
        at = list(module)
        if parts[0] == "self":
            return at + parts[1:]
        if parts[0] == "super":
            while parts and parts[0] == "super":
                parts.pop(0)
                at = at[:-1]
            return at + parts
        return at + parts if (*module, parts[0]) in self.texts else None

    def file_of(self, parts, seen=()):
        """The module in whose file a path ends."""
        module = ()
        while parts and (*module, parts[0]) in self.texts:
            module, parts = (*module, parts[0]), parts[1:]
        if not parts or module not in self.texts or (module, parts[0]) in seen:
            return module if module in self.texts else None
        passed = self.passed_on[module].get(parts[0])
        target = self.absolute(module, passed) if passed else None
        return self.file_of(target + parts[1:], (*seen, (module, parts[0]))) if target else module

    def uses(self):
        """For each module the ones that it uses, with what it names of them."""
        out = {module: {} for module in self.texts}
        for module, text in self.texts.items():
            paths = [path for found in re.finditer(r"\buse\s+([^;]+);", text) for path, _ in tree(found[1])]
            passed = set(self.passed_on[module].values())
            rest = re.sub(r"\b(pub(\([^)]*\))?\s+)?use\s+[^;]+;|\bpub\((crate|super|in [^)]*)\)", " ", text)
            paths += re.findall(r"(?<![\w:])((?:\w+::)+\w+)", rest)
            for path in paths:
                target = self.absolute(module, path) if path not in passed else None
                other = self.file_of(target) if target else None
                if other is not None and other != module:
                    out[module].setdefault(other, set()).add(path)
        return out


def circles(uses):
    """The strongly connected components of more than one node (Tarjan 1972)."""
    number, low, stack, found = {}, {}, [], []

    def visit(node):
        number[node] = low[node] = len(number)
        stack.append(node)
        for other in sorted(uses[node]):
            if other not in number:
                visit(other)
                low[node] = min(low[node], low[other])
            elif other in stack:
                low[node] = min(low[node], number[other])
        if low[node] == number[node]:
            component = [stack.pop()]
            while component[-1] != node:
                component.append(stack.pop())
            if len(component) > 1:
                found.append(sorted(component))

    for node in sorted(uses):
        if node not in number:
            visit(node)
    return found


def main():
    wrong = False
    for manifest in sorted(ROOT.glob("crates/*/Cargo.toml")) + sorted(ROOT.glob("services/*/Cargo.toml")):
        crate = Crate(manifest.parent)
        name = manifest.parent.relative_to(ROOT).as_posix()
        uses = crate.uses()
        known = [frozenset(f"src/{file}" for file in circle.split()) for circle in KNOWN.get(name, [])]
        left = set()
        for circle in circles(uses):
            files = {crate.files[module] for module in circle}
            within = {other for other in known if files <= other}
            left |= within
            wrong |= not within
            if not within or "--list" in sys.argv:
                print(f"{name}: {', '.join(sorted(files))} use each other in a circle")
                for module in circle:
                    for other in sorted(set(uses[module]) & set(circle)):
                        names = ", ".join(sorted(uses[module][other]))
                        print(f"    {crate.files[module]} uses {crate.files[other]}: {names}")
        for circle in set(known) - left:
            wrong = True
            print(f"{name}: {', '.join(sorted(circle))} are no circle any more: take them out of KNOWN")
    if wrong and "--list" not in sys.argv:
        print("Move what the files share to a file of its own.")
    return int(wrong)


if __name__ == "__main__":
    sys.exit(main())
