// The header of 3Delight. What published files take from it is in the prelude.

#include "3delight-prelude.h"
