/* The movement without a game: what a world whose game is Lua names beside its file. */
#include "car_movement.h"

TESSERA_MOVEMENT_MODULE(&car_movement)
