// A stage: canvas, camera, light. It draws when something has changed, and never while nobody can see it.

const TURN_FOR = 12_000; // one slow round after it has opened, until somebody takes over [ms]

export class Stage {
  constructor(THREE, canvas, { radius, target, up, towards }) {
    this.THREE = THREE;
    this.canvas = canvas;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true, powerPreference: "low-power" });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(30, 1, radius / 50, radius * 60);
    this.target = target.clone();
    this.shift = new THREE.Vector3(); // how far what is looked at has moved from there
    this.home = { target: target.clone(), distance: radius / Math.sin((15 * Math.PI) / 180) };
    this.frame(up, towards);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8a8f98, 0.62));
    this.light = new THREE.DirectionalLight(0xffffff, 0.62);
    this.scene.add(this.light, this.light.target);
    this.veils = null; // what is faded where it hides the grasp
    this.animations = new Set();
    this.pending = false;
    this.watch();
    this.resize();
  }

  // Axes of the view: up, and from which side it is seen at first.
  frame(up, towards) {
    const { Vector3 } = this.THREE;
    this.up = up.clone().normalize();
    const flat = towards.clone().addScaledVector(this.up, -towards.dot(this.up));
    this.east = (flat.length() > 1e-3 ? flat : new Vector3(this.up.y, this.up.z, this.up.x)).normalize();
    this.north = new Vector3().crossVectors(this.up, this.east).normalize();
    this.turn = 0;
    this.tilt = 0.35;
    this.distance = this.home.distance;
    this.target.copy(this.home.target);
  }

  watch() {
    const { canvas } = this;
    canvas.tabIndex = 0;
    canvas.style.touchAction = "none";
    const held = new Map();
    canvas.addEventListener("pointerdown", (event) => {
      this.rest();
      canvas.setPointerCapture(event.pointerId);
      held.set(event.pointerId, [event.clientX, event.clientY]);
    });
    for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, (event) => held.delete(event.pointerId));
    canvas.addEventListener("pointermove", (event) => {
      const before = held.get(event.pointerId);
      if (!before) return;
      const [dx, dy] = [event.clientX - before[0], event.clientY - before[1]];
      const others = [...held].filter(([id]) => id !== event.pointerId).map(([, where]) => where);
      if (others.length) {
        const far = (x, y) => Math.hypot(x - others[0][0], y - others[0][1]);
        this.zoom(far(...before) / Math.max(far(event.clientX, event.clientY), 1));
      } else if (event.buttons & 2 || event.shiftKey) this.pan(dx, dy);
      else this.orbit(-dx * 0.008, dy * 0.008);
      held.set(event.pointerId, [event.clientX, event.clientY]);
    });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => (event.preventDefault(), this.rest(), this.zoom(Math.exp(event.deltaY * 0.001))), { passive: false });
    const keys = {
      ArrowLeft: () => this.orbit(-0.12, 0),
      ArrowRight: () => this.orbit(0.12, 0),
      ArrowUp: () => this.orbit(0, 0.12),
      ArrowDown: () => this.orbit(0, -0.12),
      "+": () => this.zoom(0.9),
      "=": () => this.zoom(0.9),
      "-": () => this.zoom(1.1),
      Home: () => this.goHome(),
    };
    canvas.addEventListener("keydown", (event) => {
      if (!keys[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      this.rest();
      keys[event.key]();
    });
    this.resizing = new ResizeObserver(() => this.resize());
    this.resizing.observe(canvas.parentElement);
    this.seeing = new IntersectionObserver(([entry]) => {
      this.seen = entry.isIntersecting;
      if (this.seen) this.draw();
    });
    this.seeing.observe(canvas);
    this.seen = true;
    this.awake = () => document.hidden || this.draw();
    document.addEventListener("visibilitychange", this.awake);
  }

  orbit(turn, tilt) {
    this.turn += turn;
    this.tilt = Math.min(1.55, Math.max(-1.55, this.tilt + tilt));
    this.draw();
  }

  zoom(factor) {
    this.distance = Math.min(20 * this.home.distance, Math.max(0.1 * this.home.distance, this.distance * factor));
    this.draw();
  }

  pan(dx, dy) {
    const step = (this.distance * 0.54) / this.canvas.clientHeight;
    const { Vector3 } = this.THREE;
    this.target.addScaledVector(new Vector3().setFromMatrixColumn(this.camera.matrix, 0), -dx * step);
    this.target.addScaledVector(new Vector3().setFromMatrixColumn(this.camera.matrix, 1), dy * step);
    this.draw();
  }

  goHome() {
    this.turn = 0;
    this.tilt = 0.35;
    this.distance = this.home.distance;
    this.target.copy(this.home.target);
    this.draw();
  }

  // One slow round, unless the reader wants no motion.
  rotate() {
    if (matchMedia("(prefers-reduced-motion: reduce)").matches) return;
    const began = performance.now();
    let before = began;
    this.turning = (now) => {
      this.turn += ((now - before) / TURN_FOR) * 2 * Math.PI;
      before = now;
      return now - began < TURN_FOR;
    };
    this.animate(this.turning);
  }

  rest() {
    this.animations.delete(this.turning);
  }

  // Calls `step(now)` before every picture until it answers false.
  animate(step) {
    this.animations.add(step);
    this.draw();
  }

  stop(step) {
    this.animations.delete(step);
  }

  draw() {
    if (this.pending || this.ended || document.hidden || !this.seen) return;
    this.pending = true;
    requestAnimationFrame((now) => {
      this.pending = false;
      if (this.ended) return;
      for (const step of [...this.animations]) if (!step(now)) this.animations.delete(step);
      this.paint();
      if (this.animations.size) this.draw();
    });
  }

  paint() {
    const { camera, up, east, north } = this;
    const target = this.target.clone().add(this.shift);
    const flat = Math.cos(this.tilt) * this.distance;
    camera.position.copy(target);
    camera.position.addScaledVector(up, Math.sin(this.tilt) * this.distance);
    camera.position.addScaledVector(east, Math.cos(this.turn) * flat).addScaledVector(north, Math.sin(this.turn) * flat);
    camera.up.copy(up);
    camera.lookAt(target);
    camera.updateMatrix();
    this.light.target.position.copy(target);
    this.light.position.copy(camera.position).addScaledVector(up, 0.6 * this.distance);
    this.light.position.addScaledVector(new this.THREE.Vector3().setFromMatrixColumn(camera.matrix, 0), -0.5 * this.distance);
    if (this.veils) this.canvas.dataset.faded = this.veils.update(camera);
    this.renderer.render(this.scene, camera);
    this.pictures = (this.pictures ?? 0) + 1;
    this.canvas.dataset.pictures = this.pictures;
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement ?? {}; // it was taken off the page
    if (!width || !height) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    // What fits the narrower side fits both.
    this.camera.fov = width < height ? (2 * Math.atan((Math.tan((15 * Math.PI) / 180) * height) / width) * 180) / Math.PI : 30;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  end() {
    this.ended = true;
    this.resizing.disconnect();
    this.seeing.disconnect();
    document.removeEventListener("visibilitychange", this.awake);
    this.scene.traverse((one) => (one.geometry?.dispose(), one.material?.dispose?.()));
    this.renderer.dispose();
    this.renderer.forceContextLoss();
  }
}
