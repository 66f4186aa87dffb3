// The page: a websocket to the server of the window, which is opened again when it was lost.
(() => {
  const BUSY = 4001, ENDED = 4002, WRONG = 4003;  // as in server.py
  const message = document.getElementById("message"), again = message.querySelector("button");
  let socket = null, delay = 500;

  function say(text, asks) {
    message.hidden = !text;
    message.querySelector("span").textContent = text;
    again.hidden = !asks;
  }
  function send(content) {
    if (socket && socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(content));
  }
  const view = texvolView(document.getElementById("window"), send);
  document.getElementById("panels").onclick = () => view.press("tab");
  setInterval(send, 1000, {});  // the server takes long silence for a lost connection

  function connect() {
    const address = new URL("window" + location.search, location.href);
    address.protocol = address.protocol === "https:" ? "wss:" : "ws:";
    const opened = socket = new WebSocket(address);
    opened.binaryType = "arraybuffer";
    opened.onopen = () => { delay = 500; view.begin(); };
    opened.onmessage = async e => {
      say("", false);
      const head = await view.take(e.data);
      document.title = head.title;
    };
    opened.onclose = e => {
      if (e.code === BUSY) {
        say("Another viewer has this window; it comes here when that one leaves.", false);
        setTimeout(connect, 1000);
      } else if (e.code === ENDED) say("The window is closed.", false);
      else if (e.code === WRONG) say("The connection was closed: " + e.reason, true);
      else {
        say("The connection is lost; trying again.", false);
        setTimeout(connect, delay);
        delay = Math.min(2 * delay, 8000);
      }
    };
  }
  again.onclick = connect;
  connect();
})();
