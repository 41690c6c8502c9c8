// The closures of appleseed are in the prelude.

#include "appleseed.h"
