// SPDX-License-Identifier: Apache-2.0
// Comes before every test but those of real time. Engine and standard library are optimised as ever;
// GoogleTest and the tests after it, of which there are many for each law, are not: they take half as long to
// compile, and sanitizers have nothing to look for in GoogleTest.
#pragma once

#include <algorithm>
#include <any>
#include <array>
#include <atomic>
#include <cmath>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <iomanip>
#include <iostream>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <regex>
#include <set>
#include <span>
#include <sstream>
#include <string>
#include <thread>
#include <tuple>
#include <variant>
#include <vector>

#include "needleforce/base_guard.hpp"
#include "needleforce/bending/flexible_insertion.hpp"
#include "needleforce/bending/tip_estimator.hpp"
#include "needleforce/energy_controller.hpp"
#include "needleforce/events/event_detector.hpp"
#include "needleforce/exchange.hpp"
#include "needleforce/flight_recorder.hpp"
#include "needleforce/guard.hpp"
#include "needleforce/live.hpp"
#include "needleforce/solid/bent_in_solid.hpp"
#include "needleforce/solid/condensed_insertion.hpp"

#ifdef __clang__
#pragma clang optimize off
#pragma clang attribute push(__attribute__((no_sanitize("address", "undefined"))), apply_to = function)
#include <gtest/gtest.h>
#pragma clang attribute pop
#elif defined(__GNUC__)
#pragma GCC optimize("O0")
#include <gtest/gtest.h>
#endif
