// The prelude of Blender Cycles: what its shaders may use without an include, beside the standard header.
//
// Closures that the language can express are functions over today's closures. The others are declared, so that a
// file compiles; a preview shows what it does not know as squares.

#ifndef CCL_STDCYCLESOSL_H
#define CCL_STDCYCLESOSL_H

#include "stdosl.h"

#define FLT_MAX 3.402823466e+38
#define BUMP_FILTER_WIDTH 0.1

#ifndef BUILTIN
#define BUILTIN [[int builtin = 1]]
#define BUILTIN_DERIV [[int builtin = 1, int deriv = 1]]
#endif

#endif
