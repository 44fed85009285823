// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Bullet's headers, and the namespace that keeps the float and the double build of translation apart: both have
// the same Bullet names.
#pragma once

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wextra"
#pragma GCC diagnostic ignored "-Wnon-virtual-dtor"
#include <btBulletDynamicsCommon.h>
#pragma GCC diagnostic pop

#ifdef BT_USE_DOUBLE_PRECISION
#define BTGPU_SCALAR_NAMESPACE f64
#else
#define BTGPU_SCALAR_NAMESPACE f32
#endif

#define BTGPU_TRANSLATION_BEGIN \
  namespace btgpu {             \
  inline namespace BTGPU_SCALAR_NAMESPACE {
#define BTGPU_TRANSLATION_END \
  }                           \
  }
