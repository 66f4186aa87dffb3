// Choice of pictures to accept: a command to paste, or a button where the page is served by texvol accept.

const acceptance = document.getElementById('accept');
if (acceptance) {
  const command = document.getElementById('accept-command'), button = document.getElementById('accept-button');
  const result = document.getElementById('accept-result'), served = document.querySelector('meta[name=texvol-accept]');
  const boxes = [...document.querySelectorAll('input[name=accept]')];
  const chosen = () => boxes.filter(each => each.checked && !each.disabled);

  // The command as it was where the report was written; of a report that was moved, with the folder where it is now.
  let line = command.dataset.command;
  const folder = decodeURIComponent(location.pathname).replace(/\/[^/]*$/, '').replace(/^\/(?=[A-Za-z]:)/, '');
  if (location.protocol === 'file:' && !`/${folder}`.endsWith(`/${line.replace('texvol accept ', '')}`)) {
    line = `texvol accept '${folder.replaceAll("'", "'\\''")}'`;
    acceptance.querySelector('code').textContent = line;
  }

  const tell = () => {
    const names = chosen().map(each => each.value);
    command.textContent = [line, ...(names.length ? names : ['PICTURE …'])].join(' ');
    button.disabled = !names.length;
    button.textContent = `Accept ${names.length} chosen`;
  };

  const accept = async () => {
    const taken = chosen();
    button.disabled = true;
    try {
      const answer = await fetch(served.content, {
        method: 'POST', headers: {'Content-Type': 'application/json'},
        body: JSON.stringify({pictures: taken.map(each => each.value)}),
      });
      const told = await answer.json();
      if (!answer.ok) throw new Error(told.error);
      taken.forEach(each => { each.disabled = true; each.parentElement.lastChild.textContent = ' accepted'; });
      result.textContent = told.accepted.join('\n');
    } catch (error) {
      result.textContent = `Not accepted: ${error.message}`;
    }
    tell();
  };

  button.hidden = !served;
  button.addEventListener('click', accept);
  boxes.forEach(each => each.addEventListener('change', tell));
  tell();
}
