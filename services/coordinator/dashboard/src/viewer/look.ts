// Materials and light.

import { AmbientLight, Color, DirectionalLight, DoubleSide, FrontSide, HemisphereLight, MeshLambertMaterial, type Scene } from 'three';

export const material = (bothSides: boolean, colour?: number) =>
  new MeshLambertMaterial({
    color: colour ?? 0xffffff,
    vertexColors: colour === undefined,
    side: bothSides ? DoubleSide : FrontSide,
    // The floor of a building and the ground lie in one place.
    polygonOffset: colour !== undefined,
    polygonOffsetFactor: 1,
    polygonOffsetUnits: 1,
  });

export function light(scene: Scene) {
  const sun = new DirectionalLight(0xfff4e0, 2.1);
  sun.position.set(-0.6, -0.75, 1.1);
  const sky = new HemisphereLight(0xdfe9f5, 0x8a8072, 1.1);
  sky.position.set(0, 0, 1);
  scene.add(sun, sky, new AmbientLight(0xffffff, 0.25));
}

export const background = (dark: boolean) => new Color(dark ? 0x14181d : 0xdfe6ec);
