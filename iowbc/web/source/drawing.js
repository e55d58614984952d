/** Draws a world with three.js: the shapes of its bodies on a ground that goes with the robot. */

import * as three from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

const UP = new three.Vector3(0, 0, 1);
const TILE = 0.5, GROUND = 40, SEGMENTS = 24;
const THEMES = {
  light: { background: 0xeef1f4, ground: ["#e3e7eb", "#d6dbe0"], sky: 0xffffff, below: 0xb8bec6 },
  dark: { background: 0x14181d, ground: ["#2b333c", "#232a32"], sky: 0xdde6f0, below: 0x4a525c },
};

function geometry({ shape, size }) {
  const [a, b, c] = size;
  if (shape === "box") return new three.BoxGeometry(2 * a, 2 * b, 2 * c);
  if (shape === "sphere") return new three.SphereGeometry(a, SEGMENTS, SEGMENTS / 2);
  if (shape === "ellipsoid") return new three.SphereGeometry(1, SEGMENTS, SEGMENTS / 2).scale(a, b, c);
  const along = shape === "capsule" ? new three.CapsuleGeometry(a, 2 * b, 8, SEGMENTS) : new three.CylinderGeometry(a, a, 2 * b, SEGMENTS);
  return along.rotateX(Math.PI / 2);
}

function checkered([first, second]) {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 2;
  const pen = canvas.getContext("2d");
  pen.fillStyle = first;
  pen.fillRect(0, 0, 2, 2);
  pen.fillStyle = second;
  pen.fillRect(0, 0, 1, 1);
  pen.fillRect(1, 1, 1, 1);
  const texture = new three.CanvasTexture(canvas);
  texture.colorSpace = three.SRGBColorSpace;
  texture.wrapS = texture.wrapT = three.RepeatWrapping;
  texture.magFilter = three.NearestFilter;
  texture.repeat.set(GROUND / TILE / 2, GROUND / TILE / 2);
  texture.anisotropy = 8;
  return texture;
}

export class Drawing {
  /** `theme`: "light" or "dark". Throws where the browser has no WebGL. */
  constructor(canvas, theme) {
    const colours = THEMES[theme];
    this.renderer = new three.WebGLRenderer({ canvas, antialias: true });
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.renderer.shadowMap.enabled = true;
    this.scene = new three.Scene();
    this.scene.background = new three.Color(colours.background);
    this.scene.fog = new three.Fog(colours.background, 6, 16);
    this.camera = new three.PerspectiveCamera(40, 1, 0.05, 40);
    this.camera.up.copy(UP);
    this.camera.position.set(2.2, -2.4, 1.4);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.target.set(0.1, 0, 0.72);
    this.controls.maxPolarAngle = 0.52 * Math.PI;
    this.controls.minDistance = 1;
    this.controls.maxDistance = 8;
    this.at = [0, 0];
    this.ground = new three.Mesh(
      new three.PlaneGeometry(GROUND, GROUND),
      new three.MeshStandardMaterial({ map: checkered(colours.ground), roughness: 1 }),
    );
    this.ground.receiveShadow = true;
    this.sun = new three.DirectionalLight(0xffffff, 2.2);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(1024, 1024);
    this.sun.shadow.radius = 4;
    this.sun.shadow.normalBias = 0.02;
    Object.assign(this.sun.shadow.camera, { left: -1.5, right: 1.5, top: 1.8, bottom: -1.2, near: 1, far: 8 });
    this.scene.add(this.ground, this.sun, this.sun.target, new three.HemisphereLight(colours.sky, colours.below, 1.6));
    this.bodies = new Map();
  }

  /** Shows the shapes of a world in place of those of another. */
  show(world) {
    for (const group of this.bodies.values()) {
      group.traverse((part) => part.isMesh && (part.geometry.dispose(), part.material.dispose()));
      this.scene.remove(group);
    }
    this.bodies.clear();
    for (const look of world.scene.looks) {
      const [red, green, blue, alpha] = look.colour;
      const colour = new three.Color().setRGB(red, green, blue, three.SRGBColorSpace);
      const material = new three.MeshStandardMaterial({ color: colour, roughness: 0.55, opacity: alpha, transparent: alpha < 1 });
      const mesh = new three.Mesh(geometry(look), material);
      mesh.castShadow = mesh.receiveShadow = true;
      const [w, x, y, z] = look.quaternion;
      mesh.position.set(...look.position);
      mesh.quaternion.set(x, y, z, w);
      if (!this.bodies.has(look.body)) this.bodies.set(look.body, new three.Group());
      this.bodies.get(look.body).add(mesh);
    }
    this.scene.add(...this.bodies.values());
  }

  /** Draws the world as it is now; camera, sun and ground follow the robot. */
  draw(world) {
    for (const [body, group] of this.bodies) {
      const [w, x, y, z] = world.quaternion(body);
      group.position.set(...world.position(body));
      group.quaternion.set(x, y, z, w);
    }
    const [x, y] = world.position(world.scene.base);
    const moved = new three.Vector3(x - this.at[0], y - this.at[1], 0);
    this.at = [x, y];
    this.camera.position.add(moved);
    this.controls.target.add(moved);
    this.controls.update();
    this.sun.target.position.set(x, y, 0.6);
    this.sun.position.set(x + 1.5, y - 1.2, 4);
    const whole = 2 * TILE;
    this.ground.position.set(Math.round(x / whole) * whole, Math.round(y / whole) * whole, 0);
    this.renderer.render(this.scene, this.camera);
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.renderer.domElement;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
  }
}
