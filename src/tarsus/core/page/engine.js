// The engine in a page or in Node: one packet in its memory, run again and again with other numbers in its row.
class Engine {
  // module: a WebAssembly.Module; packet: an ArrayBuffer. Throws an Error with the engine's words for a packet that is none.
  constructor(module, packet) {
    Object.assign(this, { module, packet });
    this.begin();
  }

  begin() {
    const asked = {};
    for (const { module, name } of WebAssembly.Module.imports(this.module)) {
      (asked[module] ??= {})[name] = () => { throw new Error(`the engine asked for ${name}`); };
    }
    this.calls = new WebAssembly.Instance(this.module, asked).exports;
    this.calls._initialize();
    this.room = null;
    const bytes = this.packet.byteLength, at = this.calls.reserve(bytes);
    new Uint8Array(this.calls.memory.buffer).set(new Uint8Array(this.packet), at);
    this.plan = this.told(() => this.calls.plan(at, bytes));
    this.parts = this.places(at);
  }

  // What a call gives; what stops the engine is an Error with its words.
  told(call) {
    try {
      return call();
    } catch (error) {
      const bytes = new Uint8Array(this.calls.memory.buffer), at = this.calls.trouble();
      throw new Error(new TextDecoder().decode(bytes.subarray(at, bytes.indexOf(0, at))) || error.message);
    }
  }

  // Where each array of the packet stands: see packet/packet.hpp.
  places(at) {
    const view = new DataView(this.calls.memory.buffer), names = new TextDecoder(), out = {};
    let left = Number(view.getBigInt64(at + 8, true));
    for (at += 16; left--;) {
      const name = names.decode(new Uint8Array(view.buffer, at, 48)).replace(/\0+$/, '');
      const kind = view.getBigInt64(at + 48, true) ? BigInt64Array : Float64Array, count = Number(view.getBigInt64(at + 56, true));
      out[name] = { kind, at: at + 64, count };
      at += 64 + 8 * count;
    }
    return out;
  }

  // An array of the packet, as it is now; good until the next run.
  array(name) {
    const { kind, at, count } = this.parts[name];
    return new kind(this.calls.memory.buffer, at, count);
  }

  get duration() {
    return this.calls.duration(this.plan);
  }

  // A run until `end` [s], the packet's own where it is left out, with samples at times [s], increasing: code, or refusals (rows of 4: run, fault, foot, by) where it cannot start; events in rows
  // of 12, samples in rows of `width`, marks, finish. Where what is seen is asked for, also its rows (of `seenWidth`; see
  // packet/page_samples.hpp), in place of samples, and measures (value, spread, n). After a failure the engine is made anew, with the
  // packet's own numbers.
  run(times, seen = false, end = this.duration) {
    const { calls, plan } = this;
    let code;
    try {
      this.give(times);
      code = this.told(() => calls.run(plan, this.room.at, times.length, seen, end));
    } catch (error) {
      this.begin();
      throw error;
    }
    const taken = (at, count) => new Float64Array(calls.memory.buffer, at, count).slice();
    const samples = code < 0 || seen ? 0 : times.length * calls.sample_width(plan);
    const found = {
      code, finish: taken(calls.finish(plan), 3), memory: calls.memory.buffer.byteLength,
      events: taken(calls.events(plan), calls.event_numbers(plan)), marks: taken(calls.marks(plan), calls.mark_numbers(plan)),
      refusals: taken(calls.refusals(plan), calls.refusal_numbers(plan)), width: calls.sample_width(plan),
      samples: taken(calls.samples(plan), samples),
    };
    if (!seen) return found;
    return {
      ...found, frames: taken(calls.frames(plan), calls.frame_numbers(plan)), seenWidth: calls.frame_width(plan),
      measures: taken(calls.measures(plan), calls.measure_numbers(plan)),
    };
  }

  // Lays times where the engine reads them, in room that is kept from run to run.
  give(times) {
    if (!this.room || this.room.count < times.length) {
      this.room = { at: this.calls.reserve(16 * times.length), count: 2 * times.length };
    }
    new Float64Array(this.calls.memory.buffer, this.room.at, times.length).set(times);
  }
}
