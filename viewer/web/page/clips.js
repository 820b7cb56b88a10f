// Clips of the garments: the first one plays; a list, pause, a slider and speed. Without clips nothing of it is seen.
import {AnimationMixer} from 'three';

/** Seconds of a step by an arrow key. */
const STEP = 1 / 30;
const by_id = (id) => document.getElementById(id);

export class Clips {
  /** Seconds of the clip, and whether it goes on. */
  time = 0;
  plays = !matchMedia('(prefers-reduced-motion: reduce)').matches;
  duration = 0;
  #mixers = [];

  /** `garments`: { scene, animations } each; `posed()` is called when they have moved, `drawn()` draws them. */
  constructor(garments, posed, drawn) {
    this.garments = garments.filter(({animations}) => animations.length > 0);
    Object.assign(this, {posed, drawn});
    if (this.garments.length === 0) return;
    by_id('clips').hidden = false;
    const names = this.garments.flatMap(({animations}) => animations.map(({name}) => name));
    by_id('clip').replaceChildren(...[...new Set(names)].map((name) => new Option(name)));
    by_id('clip').addEventListener('change', ({target: {value}}) => this.choose(value));
    by_id('play').addEventListener('click', () => this.play(!this.plays));
    by_id('moment').addEventListener('input', ({target: {value}}) => {
      this.play(false);
      this.seek(Number(value));
    });
    addEventListener('keydown', (event) => {
      if (event.target.closest('input, textarea, select, button, [role=slider]')) return;
      const steps = {ArrowLeft: -1, ArrowRight: 1}[event.key];
      if (event.key !== ' ' && !steps) return;
      event.preventDefault();
      this.play(steps ? false : !this.plays);
      if (steps) this.seek(this.time + steps * STEP);
    });
    // A pose may leave the sphere around the rest.
    for (const {scene} of this.garments) scene.traverse((mesh) => mesh.isMesh && (mesh.frustumCulled = false));
    this.choose(names[0]);
    this.play(this.plays);
  }
  choose(name) {
    for (const mixer of this.#mixers) mixer.stopAllAction();
    this.#mixers = [];
    this.duration = 0;
    for (const {scene, animations} of this.garments) {
      const clip = animations.find((one) => one.name === name);
      if (!clip) continue;
      const mixer = new AnimationMixer(scene);
      mixer.clipAction(clip).play();
      this.#mixers.push(mixer);
      this.duration = Math.max(this.duration, clip.duration);
    }
    by_id('moment').max = this.duration;
    this.seek(0);
  }
  seek(time) {
    this.time = this.duration > 0 ? ((time % this.duration) + this.duration) % this.duration : 0;
    for (const mixer of this.#mixers) mixer.setTime(this.time);
    by_id('moment').value = this.time;
    this.posed();
  }
  async play(plays) {
    const was = this.runs;
    this.plays = plays;
    by_id('play').textContent = plays ? 'Pause' : 'Play';
    if (was || !plays) return;
    this.runs = true;
    for (let last = performance.now(); this.plays;) {
      await this.drawn();
      const now = performance.now();
      if (this.plays) this.seek(this.time + (now - last) / 1000 * Number(by_id('speed').value));
      last = now;
    }
    this.runs = false;
  }
}
