// Who drives: a page that watches asks for the wheel, and the page that drives hands it over.

import { wheelNews } from "./states.js";

const at = (id) => document.getElementById(id);
/** The feed that was shown last. */
let shown = null;
/** Whether this page has withdrawn its request, which is then no news. */
let withdrawn = false;

/** Shows the form for asking, and who asks. `say(words)` shows what became of a request. */
export function showWheel({ up, drives, study, feed }, say) {
  const news = wheelNews(shown, feed);
  shown = feed;
  if (news && !withdrawn) say(news);
  withdrawn &&= Boolean(feed?.asks);
  at("plea").hidden = !up || !feed || drives || feed.wheel || study;
  at("plea").classList.toggle("asks", Boolean(feed?.asks));
  const button = at("plea").querySelector("button");
  const words = feed?.asks ? "Stop asking" : "Ask for the wheel";
  if (button.textContent !== words) button.textContent = words;
  showPleas(up && drives ? feed?.pleas ?? [] : []);
}

/** Lists the pages that ask. */
function showPleas(pleas) {
  const list = at("pleas");
  const key = JSON.stringify(pleas);
  if (list.dataset.shown === key) return;
  list.dataset.shown = key;
  list.hidden = pleas.length === 0;
  const button = (textContent, does, page) => Object.assign(document.createElement("button"), { textContent, value: `${does} ${page}` });
  list.replaceChildren(...pleas.flatMap(({ page, name }) => [
    Object.assign(document.createElement("p"), { textContent: `${name} asks for the wheel.` }),
    button("Hand over", "give", page), button("Not now", "decline", page),
  ]));
}

/**
 * Connects the form and the list. `wish(body, words)` sends what a person wants with the wheel, and then shows `words`. `people`
 * knows the person's name.
 */
export function bindWheel(wish, people) {
  at("plea-name").value = people.name;
  at("plea").addEventListener("submit", (event) => {
    event.preventDefault();
    if (shown?.asks) {
      withdrawn = true;
      wish("withdraw", "You no longer ask for the wheel.");
      return;
    }
    const name = at("plea-name").value.trim();
    people.rename(name);
    wish({ ask: name }, "You have asked for the wheel.");
  });
  at("pleas").addEventListener("click", ({ target }) => {
    const [does, page] = (target.closest("button")?.value ?? "").split(" ");
    if (page) wish({ [does]: Number(page) }, does === "give" ? "Another page drives now." : "You keep the wheel.");
  });
}
