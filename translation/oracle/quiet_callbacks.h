// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../bullet.h"

BTGPU_TRANSLATION_BEGIN

// While one lives, what happens to manifolds on its thread is not told to gContactStartedCallback and
// gContactEndedCallback; what happens on other threads is. Those are globals of the process: for that time forwarders
// take their place, if the application has set any.
class QuietCallbacks {
 public:
  QuietCallbacks();
  ~QuietCallbacks();
  QuietCallbacks(const QuietCallbacks&) = delete;
  QuietCallbacks& operator=(const QuietCallbacks&) = delete;
};

BTGPU_TRANSLATION_END
