"""Compile every kernel once, so that the first real request does not wait for it."""

from fingersplit.compilation import kernel_cache_folder
from fingersplit.hands.hand import Hand
from fingersplit.objects.model import prepare_object
from fingersplit.objects.parametric import cylinder
from fingersplit.planning import plan

__all__ = ["compile_kernels", "kernels_are_compiled"]


def kernels_are_compiled() -> bool:
    """Whether the cache holds compiled kernels of these sources."""
    return kernel_cache_folder("fingersplit.splitting.finger_splitting").exists()


def compile_kernels(hand: Hand) -> None:
    """Plan two starts on a small object; takes about a minute with an empty cache, else seconds."""
    plan(prepare_object(cylinder(), "warm-up"), hand, starts=2, top_k=1)
