// SPDX-License-Identifier: Apache-2.0
// Streams through the event detector of the C++ headers; README.md says what a stream is.
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>

#include "needleforce/events/event_detector.hpp"

using namespace needleforce::events;

int main(int count, char** paths) {
  for (int i = 1; i < count; ++i) {
    std::printf("case %s\n", paths[i]);
    std::ifstream file(paths[i]);
    EventDetector watch;
    EventDetector::Saved kept = watch.save();
    for (std::string line; std::getline(file, line);) {
      if (line == "keep") kept = watch.save();
      if (line == "restore") std::puts(watch.restore(kept) ? "taken" : "refused");
      if (line == "reset") watch.reset();
      std::string force, depth, dt;
      if (!(std::istringstream(line) >> force >> depth >> dt)) continue;
      const Detection e = watch.step(std::strtod(force.c_str(), nullptr), std::strtod(depth.c_str(), nullptr),
                                     std::strtod(dt.c_str(), nullptr));
      std::printf("%.17g %.17g %.17g %.17g %.17g %.17g %.17g %s %s\n", e.time, e.depth, e.size, e.probability,
                  e.delay, watch.noise(), watch.needed_fall(), event_kind_names[std::size_t(e.kind)],
                  stream_status_names[std::size_t(watch.status())]);
    }
  }
}
