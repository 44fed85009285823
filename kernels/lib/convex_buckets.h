// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Which convex pairs a kernel is built for: stages 44 and 46 are built twice, with BTGPU_CURVED for the pairs with something
// curved.
#ifndef BTGPU_LIB_CONVEX_BUCKETS_H
#define BTGPU_LIB_CONVEX_BUCKETS_H
#include "../shared/shape.h"

#ifdef BTGPU_CURVED
#define FIRST_BUCKET BUCKET_CURVED
#define LAST_BUCKET BUCKET_CURVED
#else
#define FIRST_BUCKET BUCKET_FIRST_CONVEX
#define LAST_BUCKET BUCKET_HULL_HULL
#endif

#endif
