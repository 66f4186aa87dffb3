// Starts the viewer when the pixels are decoded.

async function start() {
  const facts = JSON.parse(element('facts').textContent), saved = savedState();
  const pictures = await loadedPictures(facts.pictures);
  facts.colors = decoded(facts.colors);
  const settings = {
    mode: 'side', channel: saved.channel, ground: facts.hasOpacity ? 'checker' : 'black', exposure: 0,
    gain: saved.gain ?? facts.gain, rate: 2, divider: 0.5, marker: true, blinkOn: false,
    isBlinking: !matchMedia('(prefers-reduced-motion: reduce)').matches,
  };
  const stage = new Stage(element('stage'), pictures, layersOf(pictures, facts, settings), settings, facts);
  element('worst').hidden = !facts.worst;
  element('marker').parentElement.hidden = !facts.worst;
  element('ground-label').hidden = !facts.hasOpacity;
  element('not-finite').hidden = !facts.notFinite;
  document.querySelector('.clipped').textContent = facts.clipped;
  const controls = makeControls(stage, pictures, facts, settings);
  showNumbers(element('readout'), pictures, null);
  controls.setMode(saved.mode ?? 'side', false);
  if (saved.view) stage.look(saved.view);
  if (saved.pixel) stage.choose(...saved.pixel);
  document.documentElement.dataset.ready = 'true';
}

start().catch(error => {
  element('stage').textContent = `The pictures can't be shown: ${error.message}. The viewer needs a browser of 2023 or later.`;
});
