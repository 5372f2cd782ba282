// What the dashboard adds to viser's page. One module per concern:
//   session_state.js  the state of the session, and the play head as it moves
//   pace.js           how the play head moves while the session is silent
//   post.js           brings what the user does to the session
//   gestures.js       clicks, inputs, and the hand on the strip below the scene
//   clock.js          everything that shows where the play head stands
//   keyboard.js       the keys, and their list
//   charts.js         values and marks in the charts, and zoom by dragging over them
//   close_ups.js      the close-ups over the scene, which overlay.js draws from what viser_view.js reads
//   resolution.js     fewer pixels while the mouse moves what a processor draws
//   picture.js        the picture of the scene as a file
//   page_layout.js    the size of the page
//   numbers.js        numbers as people write them, where viser would read others
//   lecture.js        large type for a lecture hall
//   names.js          names of controls that viser leaves without
//   folds.js          what is unfolded
//   start.js          the page until the first picture is there
//   welcome.js        a few words for who is here for the first time
//   uploads.js        recordings that the user sends
//   link.js           the address of the page: a run and a time
//   banner.js         whether the server is there, and what the page has to say
//   reconnect.js      when viser opens its connection again
import { followPicture, watchSessionState } from "./session_state.js";
import { onPicture, picturedTime } from "./viser_view.js";
import { startBanner } from "./banner.js";
import { startCharts } from "./charts.js";
import { startClock } from "./clock.js";
import { startCloseUps } from "./close_ups.js";
import { startFolds } from "./folds.js";
import { startGestures } from "./gestures.js";
import { startKeyboard } from "./keyboard.js";
import { startLecture } from "./lecture.js";
import { startLink } from "./link.js";
import { startNames } from "./names.js";
import { startNumbers } from "./numbers.js";
import { startPicture } from "./picture.js";
import { startPageLayout } from "./page_layout.js";
import { startResolution } from "./resolution.js";
import { startStart } from "./start.js";
import { startUploads } from "./uploads.js";
import { startWelcome } from "./welcome.js";

// This script does not hold up the page, which may still be incomplete.
if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", start);
else start();

function start() {
  startStart();
  startLink();
  startClock();
  startGestures();
  startCharts();
  startCloseUps();
  startResolution();
  startPicture();
  startUploads();
  startFolds();
  startNames();
  startNumbers();
  startWelcome();
  startPageLayout();
  startLecture();
  startKeyboard();
  startBanner();
  followPicture(picturedTime, onPicture);
  watchSessionState();
}
