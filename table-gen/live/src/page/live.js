'use strict';
const SHOWN_S = 120;
const cards = new Map();
const link = document.getElementById('link');
const template = document.getElementById('charger');

function card(name) {
  let found = cards.get(name);
  if (!found) {
    const section = template.content.cloneNode(true).firstElementChild;
    section.querySelector('[data-name]').textContent = name;
    document.getElementById('chargers').append(section);
    found = { section, points: [], tick: null };
    cards.set(name, found);
  }
  return found;
}

function draw(view) {
  const { section, points, tick } = view;
  for (const field of section.querySelectorAll('[data-is]')) {
    field.textContent = tick[field.dataset.is];
  }
  section.querySelector('meter').value = tick.participation;
  const list = section.querySelector('[data-hypotheses]');
  list.replaceChildren(...tick.hypotheses.map((hypothesis) => {
    const item = document.createElement('li');
    item.className = hypothesis.holds ? 'holds' : 'fails';
    item.textContent = (hypothesis.holds ? 'yes: ' : 'NO: ') + hypothesis.name;
    return item;
  }));
  const values = points.map((point) => point.f);
  const low = Math.min(49.9, ...values), high = Math.max(50.1, ...values);
  const end = points[points.length - 1].t;
  const x = (t) => 600 * (1 - (end - t) / SHOWN_S);
  const y = (f) => 116 - 112 * (f - low) / (high - low);
  section.querySelector('polyline').setAttribute('points',
    points.map((point) => x(point.t).toFixed(1) + ',' + y(point.f).toFixed(1)).join(' '));
  section.querySelector('[data-low]').textContent = low.toFixed(2);
  section.querySelector('[data-high]').textContent = high.toFixed(2);
}

const dirty = new Set();
function take(tick) {
  const view = card(tick.charger);
  const last = view.points[view.points.length - 1];
  // A restart, or a recording from its beginning.
  if (last && tick.time_s < last.t) { view.points = []; }
  view.points.push({ t: tick.time_s, f: tick.f_hz });
  while (view.points[0].t < tick.time_s - SHOWN_S) { view.points.shift(); }
  view.tick = tick;
  if (dirty.size === 0) {
    setTimeout(() => { for (const each of dirty) { draw(each); } dirty.clear(); }, 50);
  }
  dirty.add(view);
}

const events = new EventSource('events');
events.onopen = () => { link.textContent = 'connected'; link.className = ''; };
events.onerror = () => { link.textContent = 'connection lost, trying again'; link.className = 'lost'; };
events.onmessage = (message) => take(JSON.parse(message.data));
