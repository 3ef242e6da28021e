// What the search finds, best first: Sphinx's own scores, but what a user reads comes before the
// pages of internal modules, and before what explains the code itself.
var Scorer = {
  score: ([page, , , , score]) => {
    if (page.startsWith("reference/api/chaincor.")) return score - 100;
    if (/^explanation\/(architecture|decisions)$/.test(page)) return score - 20;
    return score;
  },
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
