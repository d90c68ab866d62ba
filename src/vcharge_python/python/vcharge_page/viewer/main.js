// Puts the page together. Pictures are drawn when something changed only.

import {takeBlock, readDescription, pictureAddress} from "./data.js";
import {View} from "./view.js";
import {StillPicture} from "./still.js";
import {Points} from "./points.js";
import {Surface} from "./surface.js";
import {Drive, carOf} from "./drive.js";
import {Objects, baysOf} from "./layers.js";
import {Measure} from "./measure.js";
import {Pictures} from "./pictures.js";
import {LayerList, TimeBar} from "./panel.js";

const GROUND_REACH_M = 400;
const WANTED_MS = 35, FAST_MS = 18;  // times of a frame while the view moves
const ONE_MOVEMENT_MS = 150;  // from one frame to the wish for the next
const REST_MS = 400;  // without movement, until details follow

class Page {
  constructor(given) {
    this.given = given;
    this.canvas = document.getElementById("canvas");
    const attributes = {antialias: false, alpha: false, stencil: false};
    const context = this.canvas.getContext("webgl2", attributes);
    if (!context) {
      throw new Error("it needs a browser with WebGL 2.");
    }
    this.renderer = new THREE.WebGLRenderer({canvas: this.canvas, context, antialias: false});
    this.renderer.setClearColor(0x14171c);
    this.renderer.autoClear = false;
    this.still = new StillPicture(this.renderer);
    this.scene = new THREE.Scene();  // what stands still
    this.moving = new THREE.Scene();
    this.frames = 0;
    this.isWaiting = this.isFast = false;
    this.view = new View(this.canvas, () => this.draw());
    this.layers = new LayerList(document.getElementById("layers"), () => this.draw());
    this.fill();
    this.listen();
    this.resize();
    this.showAll();
    this.bar.choose();
  }

  fill() {
    const {given, layers} = this;
    const add = (name, objects, scene = this.scene) => {
      scene.add(...objects);
      layers.add(name, objects);
    };
    const box = given.view || {lowM: [-10, -10, 0], highM: [10, 10, 2]};
    this.points = new Points(given.chunks, takeBlock("points"), box.lowM[2], Math.max(box.highM[2], box.lowM[2] + 0.5));
    add("landmarks", [this.points.group]);
    this.drives = given.sessions.map((session, i) => new Drive(session, i));
    add("path", this.drives.map((drive) => drive.path));
    add("keyframes", this.drives.map((drive) => drive.keyframes));
    this.car = carOf(given.cameras);
    add("car", [this.car], this.moving);
    if (given.surface) {
      this.surface = new Surface(given.surface, takeBlock("heights"), pictureAddress("surfacePicture"), () => this.draw());
      add("surface", [this.surface.mesh]);
    }
    if (given.bays) {
      add("bays", [baysOf(given.bays)]);
    }
    if (given.objects) {
      this.objects = new Objects(given.objects);
      add("objects", [this.objects.group], this.moving);
    }
    this.pictures = new Pictures(document.getElementById("pictures"), given.pictures || []);
    this.told = document.getElementById("told");
    this.measure = new Measure(this.canvas, document.getElementById("measure"), (x, y, radius) => this.find(x, y, radius),
                               (text) => this.told.textContent = text, () => this.draw());
    this.scene.add(this.measure.group);
    this.bar = new TimeBar(this.drives, (number, time_s) => this.showTime(number, time_s));
    document.getElementById("title").textContent = given.title;
    const parts = given.numComponents > 1 ?
        ` Its ${given.numComponents} parts were not joined: how they lie to each other is unknown.` : "";
    document.getElementById("counts").textContent = `${given.numLandmarks} landmarks, ` +
        `${given.sessions.reduce((sum, session) => sum + session.timesS.length, 0)} keyframes.${parts}`;
  }

  listen() {
    window.addEventListener("resize", () => this.resize());
    document.getElementById("top").addEventListener("click", () => this.view.lookFromAbove());
    document.getElementById("whole").addEventListener("click", () => this.showAll());
    this.canvas.addEventListener("dblclick", (event) => {
      const {clientWidth, clientHeight} = this.canvas;
      const point = this.find(2 * event.clientX / clientWidth - 1, 1 - 2 * event.clientY / clientHeight, 0.03);
      if (point) {
        this.view.lookAt(point);
      }
    });
    window.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.altKey || event.metaKey || event.target.tagName === "SELECT") {
        return;
      }
      const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
      const actions = {m: () => this.measure.toggle(), r: () => this.showAll(), f: () => document.getElementById("follow").click()};
      if (key in actions) {
        actions[key]();
      } else if (/^[1-9]$/.test(key)) {
        this.layers.toggle(Number(key) - 1);
      } else if (!this.bar.pressKey(key, event.shiftKey) && !this.view.pressKey(key)) {
        return;
      }
      event.preventDefault();
    });
  }

  resize() {
    this.renderer.setSize(window.innerWidth, window.innerHeight, false);
    this.view.resize(window.innerWidth, window.innerHeight);
  }

  showAll() {
    this.view.slope_rad = 0.8;
    if (this.given.view) {
      this.view.lookAtBox(this.given.view.lowM, this.given.view.highM);
    }
  }

  showTime(number, time_s) {
    const drive = this.drives[number];
    if (!drive || !drive.times_s.length) {
      return;
    }
    drive.place(this.car, time_s);
    this.pictures.show(number, time_s);
    if (this.objects) {
      const text = this.objects.show(number, time_s);
      if (!this.measure.isOn) {
        this.told.textContent = text;
      }
    }
    if (document.getElementById("follow").checked) {
      this.view.lookAt(this.car.position);
    }
    this.drawMoving();
  }

  /** The point of the scene at a position on the screen: a landmark, the surface, or the ground at the height of the target. */
  find(x, y, radius) {
    const camera = this.view.camera;
    const landmark = this.points.group.visible ? this.points.pick(camera, x, y, radius, camera.aspect) : null;
    if (landmark) {
      return landmark;
    }
    const caster = new THREE.Raycaster();
    caster.setFromCamera({x, y}, camera);
    const met = this.surface && this.surface.mesh.visible ? this.surface.hit(caster.ray, GROUND_REACH_M) : null;
    const ground = new THREE.Plane(new THREE.Vector3(0, 0, 1), -this.view.target.z);
    return met || caster.ray.intersectPlane(ground, new THREE.Vector3());
  }

  /** Draws all with the next frame of the screen. */
  draw() {
    this.isStillOld = true;
    this.drawMoving();
  }

  /** Draws what moves over what stands still with the next frame of the screen. */
  drawMoving() {
    if (!this.isWaiting) {
      this.isWaiting = true;
      this.isMovement = performance.now() - this.lastFrame_ms < ONE_MOVEMENT_MS;
      requestAnimationFrame((now) => this.render(now));
    }
  }

  render(now) {
    this.isWaiting = false;
    if (this.isStillOld) {
      if (this.isMovement && this.wasStillDrawn) {
        const frame_ms = now - this.lastFrame_ms;
        this.points.adapt(WANTED_MS / frame_ms);
        this.isFast = frame_ms < (this.isFast ? 2 * WANTED_MS : FAST_MS);
      }
      this.drawStill(false);
      clearTimeout(this.rest);
      this.rest = setTimeout(() => this.drawAtRest(), REST_MS);
    }
    this.wasStillDrawn = this.isStillOld;
    this.isStillOld = false;
    this.lastFrame_ms = now;
    this.still.show(this.view.camera);
    this.renderer.render(this.moving, this.view.camera);
    this.frames += 1;
    if (this.frames === 1) {
      document.documentElement.dataset.readyMs = String(Math.round(performance.now()));
    }
  }

  drawAtRest() {
    if (!this.isWaiting) {  // else a slow computer still moves
      this.drawStill(true);
      this.drawMoving();
    }
  }

  drawStill(isAtRest) {
    this.points.select(this.view.camera, this.canvas.width, this.canvas.height, isAtRest);
    if (this.surface) {
      this.surface.setFine(isAtRest || this.isFast);
    }
    this.still.draw(this.scene, this.view.camera);
  }
}

function tellNote(text) {
  const note = document.getElementById("note");
  note.textContent = text;
  note.hidden = false;
}

function start() {
  const given = readDescription();
  if (!given.view) {
    tellNote("This map is empty: it has neither keyframes nor landmarks.");
  } else if (given.numLandmarks === 0) {
    tellNote("This map has no landmarks.");
  }
  window.vchargePage = new Page(given);
}

try {
  start();
} catch (error) {
  tellNote(`The page cannot be shown: ${error.message}`);
  throw error;
}
