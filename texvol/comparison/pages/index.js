// Filter of the pictures: by status, and by all words of the search.

const articles = [...document.querySelectorAll('article')], buttons = [...document.querySelectorAll('button[data-status]')];
const search = document.getElementById('search');
const texts = articles.map(each => each.querySelector('.words').textContent.toLowerCase());
let status = '';

function show() {
  const wanted = search.value.toLowerCase().split(/\s+/).filter(Boolean);
  let shown = 0;
  articles.forEach((each, index) => {
    each.hidden = (status && each.dataset.status !== status) || !wanted.every(word => texts[index].includes(word));
    shown += !each.hidden;
  });
  buttons.forEach(each => each.setAttribute('aria-pressed', each.dataset.status === status));
  document.getElementById('none').hidden = shown > 0;
}

if (search) {
  buttons.forEach(each => each.addEventListener('click', () => { status = each.dataset.status; show(); }));
  search.addEventListener('input', show);
  show();  // a browser that goes back keeps the search
}
