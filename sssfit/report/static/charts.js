// The points of the Pareto chart: hover and focus tell about a kernel, a click runs it.

// Charts of one channel have a button for each of them.
function startPanels() {
  for (const chart of document.querySelectorAll('.chart')) {
    const buttons = [...chart.querySelectorAll('[data-panel]')], panels = [...chart.querySelectorAll('.panel')];
    buttons.forEach((button, chosen) => button.addEventListener('click', () => {
      panels.forEach((each, k) => { each.hidden = k !== chosen; });
      buttons.forEach((each, k) => each.setAttribute('aria-pressed', String(k === chosen)));
    }));
  }
}

export function startCharts(choose) {
  startPanels();
  const words = document.getElementById('pareto-words'), points = [...document.querySelectorAll('.point[data-kernel]')];
  const front = points.filter((each) => each.classList.contains('front-point'));
  const tell = (point) => { words.textContent = point.getAttribute('aria-label'); };
  for (const point of points) {
    point.addEventListener('pointerenter', () => tell(point));
    point.addEventListener('focus', () => tell(point));
    point.addEventListener('click', () => choose(point.dataset.kernel));
    point.addEventListener('keydown', (event) => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (event.key === 'Enter' || event.key === ' ') choose(point.dataset.kernel);
      else if (step) front[(front.indexOf(point) + step + front.length) % front.length]?.focus();
      else return;
      event.preventDefault();
      event.stopPropagation();
    });
  }
  return (label) => points.forEach((each) => {
    const isChosen = each.dataset.kernel === label;
    each.classList.toggle('chosen', isChosen);
    each.setAttribute('aria-pressed', String(isChosen));
  });
}
