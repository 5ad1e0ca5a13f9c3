// The three-dimensional stage: camera, controls, tiles, and what is clicked.

import { TilesRenderer } from '3d-tiles-renderer/three';
import { GLTFExtensionsPlugin } from '3d-tiles-renderer/src/three/plugins/GLTFExtensionsPlugin.js';
import { Box3, EdgesGeometry, Group, LineBasicMaterial, LineSegments, type Material, Matrix4, Mesh, type Object3D, PerspectiveCamera, Raycaster, Scene, Vector2, Vector3, WebGLRenderer } from 'three';
import { MapControls } from 'three/addons/controls/MapControls.js';
import { type ResultPlace, authorisation, request } from '../api';
import { cityJsonScene } from './cityjson';
import { type Features, type Mode, type Properties, featuresOf, paint } from './features';
import { background, light, material } from './look';

export interface Picked {
  building: Properties;
  surface?: Properties;
}

export type Lod = 'auto' | '0' | '1' | '2';

/// What is shown: the model, the mesh that it was made from, the model over the mesh, or one beside the other with a border to move.
export const COMPARES = ['model', 'mesh', 'both', 'swipe'] as const;
export type Compare = (typeof COMPARES)[number];

export interface StageState {
  loading: boolean;
  buildings: number;
  /// Tiles of the mesh that are shown.
  mesh: number;
}

/// How much of the mesh shows through the model that lies over it.
const OVER_MESH = 0.62;

const TILESETS: Record<Lod, string> = { auto: 'buildings', 0: 'lod0', 1: 'lod1', 2: 'lod2' };
const EDGES = new LineBasicMaterial({ color: 0x1f1a17, transparent: true, opacity: 0.32 });

/// Room around the city in the picture.
const FRAME = 1.06;

/// A frame that took longer is too slow, milliseconds: thirty a second are fluid.
const SLOW = 32;

/// Least share of the pixels, along each side, while the view moves.
const MIN_QUALITY = 0.45;

/// Whether pictures are drawn by the processor, for which smooth edges are too much.
function isSoftware(): boolean {
  const context = document.createElement('canvas').getContext('webgl2');
  const names = context?.getExtension('WEBGL_debug_renderer_info');
  const name = context && names ? String(context.getParameter(names.UNMASKED_RENDERER_WEBGL)) : '';
  context?.getExtension('WEBGL_lose_context')?.loseContext();
  return /swiftshader|llvmpipe|software/i.test(name);
}

export class Stage {
  private renderer: WebGLRenderer;
  private scene = new Scene();
  private camera = new PerspectiveCamera(45, 1, 1, 20_000);
  private controls: MapControls;
  private buildings: TilesRenderer | null = null;
  private ground: TilesRenderer | null = null;
  private mesh: TilesRenderer | null = null;
  private compare: Compare = 'model';
  private border = 0.5;
  private groundOn = true;
  private fileShown = false;
  private file = new Group();
  private mode: Mode = 'semantics';
  private chosen: string | null = null;
  private wanted: string | null = null;
  private dirty = 3;
  private quality = 1;
  private slow = isSoftware();
  private lastMove = 0;
  private lastFrame = 0;
  private lastPicture = 0;
  private stopped = false;
  private observer: ResizeObserver;
  private extent = new Box3();
  /// World coordinates of the local origin.
  private origin = new Vector3();
  /// Times of the last frames, milliseconds: what the tests measure.
  readonly frames: number[] = [];
  onPick: (picked: Picked | null) => void = () => {};
  onChange: (state: StageState) => void = () => {};
  onError: (error: Error) => void = () => {};

  constructor(private canvas: HTMLCanvasElement, dark: boolean) {
    this.renderer = new WebGLRenderer({ canvas, antialias: !this.slow, powerPreference: 'high-performance' });
    this.camera.up.set(0, 0, 1);
    this.scene.background = background(dark);
    light(this.scene);
    this.scene.add(this.file);
    this.controls = new MapControls(this.camera, canvas);
    this.controls.enableDamping = true;
    this.controls.dampingFactor = 0.15;
    this.controls.maxPolarAngle = 1.5;
    this.controls.zoomToCursor = true;
    this.controls.addEventListener('change', () => this.moved());
    this.controls.listenToKeyEvents(canvas);
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(canvas.parentElement!);
    this.resize();
    let down: [number, number] | null = null;
    canvas.addEventListener('pointerdown', (e) => (down = [e.clientX, e.clientY]));
    canvas.addEventListener('pointerup', (e) => {
      if (down && Math.hypot(e.clientX - down[0], e.clientY - down[1]) < 5) this.pick(e);
      down = null;
    });
    const loop = (time: number) => {
      if (this.stopped) return;
      requestAnimationFrame(loop);
      this.frame(time);
    };
    requestAnimationFrame(loop);
  }

  redraw() {
    this.dirty = 3;
  }

  setDark(dark: boolean) {
    this.scene.background = background(dark);
    this.redraw();
  }

  private resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement!;
    if (!width || !height) return;
    this.renderer.setPixelRatio(this.quality * Math.min(2, devicePixelRatio));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    for (const tiles of this.all()) tiles.setResolutionFromRenderer(this.camera, this.renderer);
    this.redraw();
  }

  private moved() {
    this.lastMove = performance.now();
    this.redraw();
  }

  /// Slow machines get fewer pixels and no edges while the view moves, and all when it stands.
  private adapt(time: number) {
    const took = time - this.lastFrame;
    this.lastFrame = time;
    const moving = performance.now() - this.lastMove < 300;
    let quality = this.quality;
    if (!moving) quality = 1;
    else if (took > SLOW && took < 500) quality = Math.max(MIN_QUALITY, quality * 0.8);
    else if (took < 18) quality = Math.min(1, quality * 1.1);
    if (quality < 1) this.slow = true;
    const edges = !(moving && this.slow);
    if (EDGES.visible !== edges) {
      EDGES.visible = edges;
      this.redraw();
    }
    if (Math.abs(quality - this.quality) < 0.02) return;
    this.quality = quality;
    this.resize();
  }

  private frame(time: number) {
    this.controls.update();
    this.adapt(time);
    this.camera.updateMatrixWorld();
    let busy = false;
    for (const tiles of this.wantedTiles()) {
      if (this.dirty || tiles.loadProgress < 1) tiles.update();
      busy ||= tiles.loadProgress < 1;
    }
    if (busy) this.dirty = Math.max(this.dirty, 2);
    if (!this.dirty) return;
    // While tiles come in, pictures wait for them, unless the view moves.
    const moving = performance.now() - this.lastMove < 300;
    if (busy && !moving && time - this.lastPicture < 200) return;
    this.lastPicture = time;
    this.dirty--;
    this.draw();
    this.find();
    this.frames.push(time);
    if (this.frames.length > 300) this.frames.shift();
    let count = 0;
    this.meshes((mesh) => (count += featuresOf(mesh)!.buildings.length));
    this.onChange({ loading: busy, buildings: count, mesh: this.compare === 'model' || this.fileShown ? 0 : (this.mesh?.visibleTiles.size ?? 0) });
  }

  private all = () => [this.ground, this.buildings, this.mesh].filter((tiles): tiles is TilesRenderer => tiles !== null);

  /// The tiles that are loaded: those that are looked at.
  private wantedTiles(): TilesRenderer[] {
    if (this.fileShown) return [];
    const { model, ground, mesh } = this.layers();
    return this.all().filter((tiles) => (tiles === this.mesh ? mesh : tiles === this.ground ? ground : model));
  }

  /// Which layers there are in the picture. The mesh has a ground of its own.
  private layers() {
    const model = this.compare !== 'mesh';
    const mesh = this.compare !== 'model' && this.mesh !== null;
    return { model, mesh, ground: this.groundOn && (this.compare === 'swipe' || !mesh) };
  }

  private draw() {
    const { model, ground, mesh } = this.layers();
    const look = (m: boolean, g: boolean, i: boolean) => {
      if (this.buildings) this.buildings.group.visible = m && !this.fileShown;
      if (this.ground) this.ground.group.visible = g && !this.fileShown;
      if (this.mesh) this.mesh.group.visible = i && !this.fileShown;
      this.renderer.render(this.scene, this.camera);
    };
    if (this.compare !== 'swipe' || this.fileShown) return look(model, ground, mesh);
    const { x: width, y: height } = this.renderer.getSize(new Vector2());
    const border = Math.round(width * this.border);
    this.renderer.setScissorTest(true);
    this.renderer.setScissor(0, 0, border, height);
    look(false, false, true);
    this.renderer.setScissor(border, 0, width - border, height);
    look(true, ground, false);
    this.renderer.setScissorTest(false);
  }

  /// Chooses what is compared with what. The mesh is asked for when it is first wanted.
  async setCompare(place: ResultPlace, compare: Compare): Promise<void> {
    this.compare = compare;
    this.meshes((mesh) => this.translucent(mesh));
    this.redraw();
    if (compare === 'model' || this.mesh) return;
    const url = place.file('3dtiles/mesh.json');
    const tileset = await (await request(url)).json();
    if (this.stopped || this.mesh) return;
    this.mesh = this.tiles(place, url, tileset.root.transform);
    // Its coarse levels are lumps, where those of buildings are still houses.
    this.mesh.errorTarget = 6;
    this.redraw();
  }

  /// Where the border between mesh and model stands, as a part of the width.
  setBorder(part: number) {
    this.border = part;
    this.redraw();
  }

  private translucent(mesh: Mesh) {
    const over = this.compare === 'both' && !this.fileShown;
    const surface = mesh.material as Material;
    if (surface.transparent === over) return;
    surface.transparent = over;
    surface.opacity = over ? OVER_MESH : 1;
    surface.needsUpdate = true;
  }

  /// All meshes of buildings that are shown.
  private meshes(visit: (mesh: Mesh) => void) {
    const look = (object: { traverse: (f: (o: any) => void) => void }) => object.traverse((o) => featuresOf(o) && visit(o as Mesh));
    if (!this.fileShown) this.buildings?.group.children.forEach(look);
    look(this.file);
  }

  /// Shows a result at a LOD; gives whether it has buildings.
  async show(place: ResultPlace, lod: Lod): Promise<boolean> {
    const name = TILESETS[lod];
    const url = place.file(`3dtiles/${name}.json`);
    const tileset = await (await request(url)).json();
    this.buildings?.dispose();
    this.buildings?.group.removeFromParent();
    this.clearFile();
    this.origin.fromArray(tileset.asset.extras?.origin ?? [0, 0, 0]);
    this.buildings = this.tiles(place, url, tileset.root.transform);
    this.buildings.addEventListener('load-model', ({ scene }) => this.prepare(scene, lod));
    const holds = (root: any) => !!(root.content || root.children?.length);
    const built = holds(tileset.root);
    if (this.extent.isEmpty()) {
      // Without a building, the ground is looked at.
      const whole = built ? tileset : await (await request(place.file('3dtiles/tileset.json'))).json();
      if (this.stopped) return built;
      const box: number[] = whole.root.boundingVolume.box;
      const [centre, half] = [new Vector3(...box), new Vector3(box[3], box[7], box[11])];
      this.extent.set(centre.clone().sub(half), centre.clone().add(half));
      this.home();
    }
    this.redraw();
    return built;
  }

  /// Resolves when the buildings that are to be seen are there.
  private settled(): Promise<void> {
    return new Promise((resolve) => {
      const begin = performance.now();
      const look = () => {
        if (this.stopped || performance.now() - begin > 20_000 || (this.buildings && this.buildings.root && this.buildings.loadProgress === 1)) resolve();
        else setTimeout(look, 100);
      };
      look();
    });
  }

  /// Shows or hides the ground. It waits for the buildings, which are fewer bytes and what is looked for.
  async showGround(place: ResultPlace, on: boolean): Promise<void> {
    await this.settled();
    if (this.stopped) return;
    this.groundOn = on;
    if (!this.ground && on) {
      const url = place.file('3dtiles/ground.json');
      const tileset = await (await request(url)).json();
      this.ground = this.tiles(place, url, tileset.root.transform);
    }
    this.redraw();
  }

  private tiles(place: ResultPlace, url: string, transform?: number[]): TilesRenderer {
    const tiles = new TilesRenderer(url);
    tiles.fetchOptions = { headers: authorisation() };
    tiles.registerPlugin(new GLTFExtensionsPlugin({ metadata: true, autoDispose: false }));
    // Contents are named relative to the tileset; which generation they are of is in the query.
    const query = new URL(place.file('x'), location.href).search;
    tiles.registerPlugin({ preprocessURL: (address: string) => (query && !address.includes('?') ? address + query : address) });
    tiles.errorTarget = 12;
    tiles.setCamera(this.camera);
    tiles.setResolutionFromRenderer(this.camera, this.renderer);
    // The stage stands in the local frame: what takes the city to the globe is taken back.
    // As a matrix: taken apart into rotation and scale it would lose what matters at the radius of the Earth.
    if (transform) {
      tiles.group.matrixAutoUpdate = false;
      tiles.group.matrix.fromArray(transform).invert();
      tiles.group.matrixWorldNeedsUpdate = true;
    }
    tiles.addEventListener('needs-update', () => this.redraw());
    tiles.addEventListener('load-model', () => this.redraw());
    tiles.addEventListener('load-error', ({ error }) => this.onError(error));
    this.scene.add(tiles.group);
    return tiles;
  }

  /// Takes the tables of a loaded tile over, and gives it the viewer's look.
  private prepare(scene: Object3D, lod: Lod) {
    const found: Mesh[] = [];
    scene.traverse((object: any) => object.isMesh && found.push(object));
    for (const mesh of found) {
      const metadata = mesh.userData.structuralMetadata;
      const numbers = (name: string) => mesh.geometry.getAttribute(name)?.array as ArrayLike<number>;
      const [ofBuilding, ofSurface] = [numbers('_feature_id_0'), numbers('_feature_id_1')];
      if (!metadata || !ofBuilding || !ofSurface) continue;
      const rows = (table: number, count: number) => {
        const ids = Array.from({ length: count }, (_, i) => i);
        return metadata.getPropertyTableData(ids.map(() => table), ids) as Properties[];
      };
      const most = (list: ArrayLike<number>) => Array.prototype.reduce.call(list, (a: any, b: any) => Math.max(a, b), -1) as number;
      const features: Features = { ofBuilding, ofSurface, buildings: rows(0, most(ofBuilding) + 1), surfaces: rows(1, most(ofSurface) + 1) };
      mesh.userData.features = features;
      mesh.material = material(lod === '0');
      this.finish(mesh);
    }
  }

  private finish(mesh: Mesh) {
    paint(mesh, this.mode, this.chosen);
    this.translucent(mesh);
    const lines = new LineSegments(new EdgesGeometry(mesh.geometry, 20), EDGES);
    lines.raycast = () => {};
    mesh.add(lines);
    this.find();
    this.redraw();
  }

  /// Shows CityJSON files in place of tiles, from where all their buildings are seen.
  showCityJson(cities: any[], lod: Lod) {
    this.unchoose();
    this.clearFile();
    this.fileShown = true;
    let from = this.extent.isEmpty() ? null : this.origin;
    for (const city of cities) {
      const { group, origin } = cityJsonScene(city, lod, from);
      this.origin.copy(origin);
      from = this.origin;
      this.file.add(group);
    }
    this.extent.makeEmpty();
    this.meshes((mesh) => {
      this.extent.expandByObject(mesh);
      this.finish(mesh);
    });
    if (this.extent.isEmpty()) this.extent.setFromObject(this.file);
    this.home();
  }

  private clearFile() {
    this.file.traverse((o: any) => o.geometry?.dispose());
    this.file.clear();
    this.fileShown = false;
  }

  setMode(mode: Mode) {
    this.mode = mode;
    this.meshes((mesh) => paint(mesh, mode, this.chosen));
    this.redraw();
  }

  /// The whole city, seen from the south at an angle.
  home(elevation = 52) {
    const target = this.extent.getCenter(new Vector3());
    const { min, max } = this.extent;
    const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((i) => new Vector3(i & 1 ? max.x : min.x, i & 2 ? max.y : min.y, i & 4 ? max.z : min.z));
    const [sin, cos] = [Math.sin((elevation * Math.PI) / 180), Math.cos((elevation * Math.PI) / 180)];
    const [ahead, up] = [new Vector3(0, cos, -sin), new Vector3(0, sin, cos)];
    const high = Math.tan((this.camera.fov * Math.PI) / 360);
    const wide = high * this.camera.aspect;
    let distance = 40;
    // What is near looks larger: the middle of the picture is found by trying.
    for (let turn = 0; turn < 6; turn++) {
      const seen = corners.map((corner) => corner.clone().sub(target));
      distance = Math.max(40, ...seen.map((c) => Math.max(Math.abs(c.x) / wide, Math.abs(c.dot(up)) / high) * FRAME - c.dot(ahead)));
      const heights = seen.map((c) => c.dot(up) / (distance + c.dot(ahead)));
      target.y += ((Math.max(...heights) + Math.min(...heights)) / 2) * distance * 0.8 / sin;
    }
    this.fly(target, distance, sin, cos);
  }

  private fly(target: Vector3, distance: number, sin: number, cos: number) {
    this.camera.near = Math.max(0.5, distance / 1000);
    this.camera.far = Math.max(5000, distance * 20);
    this.camera.updateProjectionMatrix();
    this.controls.target.copy(target);
    this.camera.position.set(target.x, target.y - distance * cos, target.z + distance * sin);
    this.controls.update();
    this.redraw();
  }

  fromAbove() {
    const target = this.controls.target.clone();
    this.fly(target, this.camera.position.distanceTo(target), 1, 0.001);
  }

  aslant() {
    const target = this.controls.target.clone();
    this.fly(target, this.camera.position.distanceTo(target), 0.64, 0.77);
  }

  /// Looks at a box of world coordinates.
  lookAt([west, south, east, north]: number[]) {
    const z = this.extent.isEmpty() ? 0 : this.extent.getCenter(new Vector3()).z;
    const target = new Vector3((west + east) / 2 - this.origin.x, (south + north) / 2 - this.origin.y, z);
    this.fly(target, 1.3 * Math.max(east - west, north - south), 0.77, 0.64);
  }

  /// Chooses a building by its id as soon as it is there, and looks at it. Gives whether it is among what is shown when all of that is there.
  async seek(id: string): Promise<boolean> {
    this.wanted = id;
    this.find();
    if (!this.fileShown && this.wanted === id) {
      await this.settled();
      // What is asked for next is known with the next pictures.
      await new Promise((resolve) => setTimeout(resolve, 500));
      await this.settled();
    }
    this.find();
    return this.wanted !== id;
  }

  /// Chooses the building that is sought, if it is there.
  private find() {
    const id = this.wanted;
    if (id === null) return;
    this.meshes((mesh) => {
      if (this.wanted === id && this.chooseIn(mesh, id)) this.wanted = null;
    });
  }

  /// Where a mesh stands, also before its tile is shown.
  private standing(mesh: Mesh): Matrix4 {
    mesh.updateWorldMatrix(true, false);
    let top: Object3D = mesh;
    while (top.parent) top = top.parent;
    const world = mesh.matrixWorld.clone();
    return top === this.scene || !this.buildings ? world : world.premultiply(this.buildings.group.matrix);
  }

  private chooseIn(mesh: Mesh, id: string): boolean {
    const features = featuresOf(mesh)!;
    const number = features.buildings.findIndex((b) => b.id === id);
    if (number < 0) return false;
    const standing = this.standing(mesh);
    const box = new Box3();
    const positions = mesh.geometry.getAttribute('position');
    for (let i = 0; i < positions.count; i++) {
      if (features.ofBuilding[i] === number) box.expandByPoint(new Vector3().fromBufferAttribute(positions, i).applyMatrix4(standing));
    }
    this.choose(features.buildings[number]);
    if (!box.isEmpty()) this.fly(box.getCenter(new Vector3()), 4 * box.getSize(new Vector3()).length(), 0.64, 0.77);
    return true;
  }

  private choose(building: Properties | null, surface?: Properties) {
    this.chosen = building ? String(building.id) : null;
    this.meshes((mesh) => paint(mesh, this.mode, this.chosen));
    this.onPick(building ? { building, surface } : null);
    this.redraw();
  }

  unchoose() {
    this.choose(null);
  }

  private pick(event: { clientX: number; clientY: number }) {
    const frame = this.canvas.getBoundingClientRect();
    const at = new Vector2(((event.clientX - frame.left) / frame.width) * 2 - 1, 1 - ((event.clientY - frame.top) / frame.height) * 2);
    const ray = new Raycaster();
    ray.setFromCamera(at, this.camera);
    // Only what is to be seen there can be meant.
    const modelThere = this.compare === 'swipe' ? (at.x + 1) / 2 >= this.border : this.compare !== 'mesh';
    const targets = [this.fileShown ? this.file : modelThere ? this.buildings?.group : null].filter((g): g is NonNullable<typeof g> => !!g);
    const hit = ray.intersectObjects(targets, true).find((h) => featuresOf(h.object));
    if (!hit?.face) return this.choose(null);
    const features = featuresOf(hit.object)!;
    this.choose(features.buildings[features.ofBuilding[hit.face.a]], features.surfaces[features.ofSurface[hit.face.a]]);
  }

  /// Where the largest triangle of a building is on the canvas, for the tests; none if no building is shown.
  locate(): { id: string; x: number; y: number } | null {
    let found: { id: string; x: number; y: number } | null = null;
    let most = 0;
    this.meshes((mesh) => {
      const features = featuresOf(mesh)!;
      const positions = mesh.geometry.getAttribute('position');
      const corners = mesh.geometry.index?.array ?? Array.from({ length: positions.count }, (_, i) => i);
      const standing = this.standing(mesh);
      const frame = this.canvas.getBoundingClientRect();
      for (let i = 0; i < corners.length; i += 3) {
        const [a, b, c] = [0, 1, 2].map((k) => new Vector3().fromBufferAttribute(positions, corners[i + k]).applyMatrix4(standing).project(this.camera));
        // Turned to the viewer, by its area on the canvas.
        const area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
        const [x, y] = [(a.x + b.x + c.x) / 3, (a.y + b.y + c.y) / 3];
        if (area <= most || Math.abs(x) > 0.6 || Math.abs(y) > 0.6) continue;
        most = area;
        found = { id: String(features.buildings[features.ofBuilding[corners[i]]].id), x: frame.left + ((x + 1) / 2) * frame.width, y: frame.top + ((1 - y) / 2) * frame.height };
      }
    });
    return found;
  }

  /// Where the middle of each building that is drawn is in the picture, from -1 to 1, by its id: what the tests look at.
  drawn(): Record<string, [number, number]> {
    const boxes = new Map<string, Box3>();
    this.meshes((mesh) => {
      const features = featuresOf(mesh)!;
      const positions = mesh.geometry.getAttribute('position');
      const standing = this.standing(mesh);
      for (let i = 0; i < positions.count; i++) {
        const id = String(features.buildings[features.ofBuilding[i]].id);
        if (!boxes.has(id)) boxes.set(id, new Box3());
        boxes.get(id)!.expandByPoint(new Vector3().fromBufferAttribute(positions, i).applyMatrix4(standing));
      }
    });
    const middle = (box: Box3): [number, number] => {
      const at = box.getCenter(new Vector3()).project(this.camera);
      return [at.x, at.y];
    };
    return Object.fromEntries([...boxes].map(([id, box]) => [id, middle(box)]));
  }

  /// The id of the building that is chosen, for the tests.
  marked(): string | null {
    return this.chosen;
  }

  /// Turns around the city for some seconds; gives the frames in each of them.
  async turn(duration: number): Promise<number> {
    const begin = performance.now();
    let frames = 0;
    const target = this.controls.target.clone();
    const arm = this.camera.position.clone().sub(target);
    await new Promise<void>((resolve) => {
      const step = () => {
        const passed = performance.now() - begin;
        this.camera.position.copy(arm).applyAxisAngle(new Vector3(0, 0, 1), passed / 2000).add(target);
        this.moved();
        frames++;
        if (passed < duration) requestAnimationFrame(step);
        else resolve();
      };
      requestAnimationFrame(step);
    });
    return (1000 * frames) / (performance.now() - begin);
  }

  dispose() {
    this.stopped = true;
    this.observer.disconnect();
    this.controls.dispose();
    this.buildings?.dispose();
    this.ground?.dispose();
    this.mesh?.dispose();
    this.clearFile();
    this.renderer.dispose();
  }
}
